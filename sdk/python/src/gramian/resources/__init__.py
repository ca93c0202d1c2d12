"""What a registered cloud is asked: values, surfaces, operators, selection."""

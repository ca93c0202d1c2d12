"""Operations on a registered cloud: values, surfaces, operators, selection."""

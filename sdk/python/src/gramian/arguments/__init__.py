"""Arguments of calls: checked, named and made ready to be sent."""

"""Arguments of calls: checks, names in messages, and conversion to what is sent."""

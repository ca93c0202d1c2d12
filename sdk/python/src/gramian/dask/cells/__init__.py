"""A cloud in cells: where it is cut, what a cell needs of others, and tasks that bring it there."""

"""Functions of the package, one for nearly every command; the commands call them."""

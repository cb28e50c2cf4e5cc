"""The functions of the package, one for each command; the commands are thin over them."""

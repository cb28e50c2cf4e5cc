"""The functions of the package, one for nearly each command; the commands are thin over them."""

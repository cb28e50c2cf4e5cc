"""Published recordings of real machines, and whether a diagnosis names what is documented of them."""

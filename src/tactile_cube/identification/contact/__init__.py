"""The same for recordings with an object: constants of the contact, and what a grasp says of them."""

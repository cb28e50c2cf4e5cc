"""The paper's results beside ours, and the cards of the policies in the package."""

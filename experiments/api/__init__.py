"""What the installed package `rearview` is made of."""

"""Checks of input, errors, materials, functions of time and places of contactors: needed by all other parts."""

"""Damaged files of every kind that Cairn reads."""

"""Runs looked at in three dimensions: a page of its own (`page`), a server for the browser (`live`)."""

"""Imports that wait until their first use, because most programs never use them."""

"""Fake devices that speak the wire protocols, each a program of its own."""

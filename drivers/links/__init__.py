"""Links: what brings a device's bytes or registers here. A link knows no format."""

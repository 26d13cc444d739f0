"""Links: what brings a device's bytes or registers here. A link knows no format.

`serial_scanner` and `modbus_scanner` are imported by name, and only where one is opened: they load pyserial and pymodbus.
"""

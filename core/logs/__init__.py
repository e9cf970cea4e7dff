"""Reading robot logs: bytes in, a JointLog out."""

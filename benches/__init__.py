"""Measured work, beside Mitsuba 3 on the same machine in the same run."""

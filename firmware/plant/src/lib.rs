//! What the boards are wired to: warehouse, tape, sensors, motors, servos.

//! Dynamixel protocol 1.0 as the AX-12 servos speak it.

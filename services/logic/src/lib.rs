//! The logic unit: a pure navigator in a thin shell.

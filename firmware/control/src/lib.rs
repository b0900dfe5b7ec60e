//! Every decision the two boards take, on integers, behind a board trait.

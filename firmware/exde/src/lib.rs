//! ExDe, the synchronous one-way bit bus between the boards.

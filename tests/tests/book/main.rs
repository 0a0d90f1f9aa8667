//! The book says what is true: its tutorials work as they are written, its reference pages are what the program says, its
//! gallery's commands run, and its links lead somewhere.
//!
//! Pages that the code generates are written anew with `RESOLVENT_WRITE_BOOK=1 cargo test --release -p resolvent-tests --test book`.

mod gallery;
mod links;
mod pages;
mod program;
mod reference;
mod tutorials;

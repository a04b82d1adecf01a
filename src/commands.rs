//! The commands of the program, each a function of plain values; the command line is read elsewhere.

pub mod check;

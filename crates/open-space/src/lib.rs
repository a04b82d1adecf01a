//! The open-space trajectory provider: plans parking and tight manoeuvres, and keeps a vehicle safe while a plan is
//! missing.
//!
//! Pure: no threads, clocks, files or logging. Time is an argument, deadlines are a question the caller answers.

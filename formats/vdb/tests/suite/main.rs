//! The tests of the reader as a whole; small parts are tested beside their code.

mod corpus;
mod crafted;
mod fuzz;
mod hostile;
mod memory;
mod mutate;
mod sidecar;
mod windows;
mod witness;
mod writer;

#[global_allocator]
static ALLOCATOR: memory::Counting = memory::Counting;

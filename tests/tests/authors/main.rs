//! What somebody does who writes a plugin with nothing but the program and `core/api`: starts from a template, or takes an example out
//! of the tree; builds it with `cargo` or `make`, runs its test, has it checked, and renders its scene.

mod compilers;
mod examples;
mod project;
mod templates;

//! Plugins: finding, loading, declaring, making instances, and calling them through the ordinary traits' shapes.

mod copy;
mod declare;
mod foreign;
mod host;
#[cfg(target_os = "linux")]
mod image;
mod instance;
mod load;
mod registry;

pub use foreign::{ForeignBsdf, ForeignIntegrator, ForeignMedium, ForeignPhase};
pub(crate) use host::warn;
pub use host::{Message, pending_failure, set_log};
pub use instance::Instance;
pub use load::Plugin;
pub use registry::{Found, Registry};

//! Plugins: finding, loading, declaring, making instances, and calling them through the ordinary traits' shapes.

mod declare;
mod foreign;
mod host;
mod instance;
mod load;
mod registry;

pub use foreign::{ForeignBsdf, ForeignIntegrator, ForeignMedium, ForeignPhase};
pub use host::{Message, set_log};
pub(crate) use host::{pending_failure, warn};
pub use instance::Instance;
pub use load::Plugin;
pub use registry::Registry;

//! What can go wrong between a scene and its picture.

use resolvent_scene::Problem;

/// Why a scene could not be built or rendered.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The scene is wrong: each problem has its place.
    #[error("{}", lines(.0))]
    Scene(Vec<Problem>),
    /// A plugin cannot be found or loaded, or broke while rendering.
    #[error("{0}")]
    Plugin(String),
    /// Anything else about the input (images, geometry, settings).
    #[error("{0}")]
    Input(String),
}

fn lines(problems: &[Problem]) -> String {
    problems
        .iter()
        .map(Problem::to_string)
        .collect::<Vec<_>>()
        .join("\n")
}

impl From<Problem> for Error {
    fn from(p: Problem) -> Self {
        Self::Scene(vec![p])
    }
}

/// A result with the engine's error.
pub type Result<T> = std::result::Result<T, Error>;

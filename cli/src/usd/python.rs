//! Finding a Python that has the package `resolvent_usd`.

use crate::failure::{Failure, Outcome, input};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Names an interpreter that is taken without looking for others.
const VARIABLE: &str = "RESOLVENT_PYTHON";

/// The package's sources, if the program runs where it was built.
const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../formats/usd");

/// An interpreter that has the package.
pub struct Python {
    path: PathBuf,
    fingerprint: String,
}

impl Python {
    /// The interpreter that `RESOLVENT_PYTHON` names, else the first one with the package: that of the managed environment, of the
    /// sources' own one, of the active one, and `python3`.
    ///
    /// # Errors
    /// If there is none; the message has the command that makes one.
    pub fn find() -> Outcome<Self> {
        if let Some(named) = std::env::var_os(VARIABLE) {
            let path = PathBuf::from(named);
            return Self::probe(&path).map_err(|why| {
                input(format!(
                    "{VARIABLE} is {}, which can't be used: {why}; without it, this makes an environment that is found: {}",
                    path.display(),
                    recipe()
                ))
            });
        }
        let active = std::env::var_os("VIRTUAL_ENV").map(PathBuf::from);
        let environments = [managed(), Some(Path::new(SOURCES).join(".venv")), active];
        let candidates = environments
            .into_iter()
            .flatten()
            .map(|e| e.join("bin/python"))
            .filter(|p| p.exists())
            .chain([PathBuf::from("python3")]);
        let mut why = String::new();
        for path in candidates {
            match Self::probe(&path) {
                Ok(found) => return Ok(found),
                Err(reason) => why = format!("{}: {reason}", path.display()),
            }
        }
        Err(input(format!(
            "USD stages are read by the Python package resolvent_usd, and no Python has it ({why}); this makes one (Python 3.10 or newer): {}",
            recipe()
        )))
    }

    /// Asks an interpreter for the package.
    fn probe(path: &Path) -> Result<Self, String> {
        let out = Command::new(path)
            .args(["-c", "import resolvent_usd as r; print(r.fingerprint())"])
            .stdin(Stdio::null())
            .output()
            .map_err(|e| e.to_string())?;
        if !out.status.success() {
            let said = String::from_utf8_lossy(&out.stderr);
            return Err(said.lines().last().unwrap_or("it fails").to_owned());
        }
        Ok(Self {
            path: path.to_path_buf(),
            fingerprint: String::from_utf8_lossy(&out.stdout).trim().to_owned(),
        })
    }

    /// Of the package and of what it stands on.
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// A call of the interpreter. It finds this program by `RESOLVENT_PROGRAM`, to ask it what is in VDB files.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.path);
        if let Ok(program) = std::env::current_exe() {
            command.env("RESOLVENT_PROGRAM", program);
        }
        command
    }

    /// It was found, but does not start.
    pub fn broken(&self, error: &std::io::Error) -> Failure {
        input(format!("{}: {error}", self.path.display()))
    }
}

/// The environment that the recipe makes.
fn managed() -> Option<PathBuf> {
    let data = match std::env::var_os("XDG_DATA_HOME").filter(|v| !v.is_empty()) {
        Some(data) => PathBuf::from(data),
        None => PathBuf::from(std::env::var_os("HOME")?).join(".local/share"),
    };
    Some(data.join("resolvent/usd"))
}

/// The command that makes the managed environment.
fn recipe() -> String {
    let place = managed().unwrap_or_else(|| PathBuf::from(".venv"));
    let package = match Path::new(SOURCES).canonicalize() {
        Ok(sources) => sources.display().to_string(),
        Err(_) => "formats/usd".to_owned(),
    };
    format!(
        "python3 -m venv {0} && {0}/bin/pip install {package}",
        place.display()
    )
}

//! What the operating system says about memory, time and the ends of processes.

use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;

/// Largest memory this process has held, bytes; `None` where the system does not say.
pub fn peak_memory() -> Option<u64> {
    proc_kilobytes("/proc/self/status", "VmHWM:")
}

/// Memory that can be had without swapping, bytes; `None` where the system does not say.
pub fn available_memory() -> Option<u64> {
    proc_kilobytes("/proc/meminfo", "MemAvailable:")
}

/// CPU seconds that this process has taken, over all its threads; `None` where the system does not say.
pub fn cpu_seconds() -> Option<f64> {
    use nix::sys::resource::{UsageWho, getrusage};
    let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
    let seconds = [usage.user_time(), usage.system_time()]
        .map(|t| t.tv_sec() as f64 + t.tv_usec() as f64 * 1e-6);
    Some(seconds[0] + seconds[1])
}

/// What ended a process that did not end by itself as it should.
pub fn ending(status: ExitStatus) -> String {
    let Some(signal) = status.signal() else {
        return format!("it ends the process: {status}");
    };
    let name = match signal {
        4 => "SIGILL",
        6 => "SIGABRT",
        7 => "SIGBUS",
        8 => "SIGFPE",
        9 => "SIGKILL",
        11 => "SIGSEGV",
        _ => "a signal",
    };
    format!("it crashes: {name} ({signal})")
}

fn proc_kilobytes(file: &str, key: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix(key))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}

#[cfg(test)]
mod tests {
    #[test]
    #[cfg(target_os = "linux")]
    fn linux_says_it() {
        let peak = super::peak_memory().unwrap();
        assert!((1 << 19..1 << 40).contains(&peak), "{peak}");
        assert!(super::available_memory().unwrap() > 0);
    }
}

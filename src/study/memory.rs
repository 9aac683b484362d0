//! How much memory the program holds, where the system tells it (Linux).

use std::fs;

/// Most memory the program has held, in bytes, since its start or the last [`forget_peak`].
pub fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// Begins anew to watch for the peak, which is then at least what is held now. False where the system
/// does not offer it: the peak is that of the whole program then.
pub fn forget_peak() -> bool {
    // proc(5): 5 resets the peak resident set size of the process.
    fs::write("/proc/self/clear_refs", "5").is_ok()
}

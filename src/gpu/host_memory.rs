//! Memory of the machine, for devices that have none of their own.

use std::fs::read_to_string;

/// Bytes that programs can still take without others being swapped out, as far as the system tells: `None`
/// where it does not.
pub(super) fn available() -> Option<u64> {
    let free = read_to_string("/proc/meminfo").ok().and_then(|text| kilobytes(&text, "MemAvailable:"))?;
    // Within a container it may be less.
    let number = |path: &str| read_to_string(path).ok()?.trim().parse::<u64>().ok();
    let left = number("/sys/fs/cgroup/memory.max").zip(number("/sys/fs/cgroup/memory.current"));
    let left = left.map(|(most, taken)| {
        // Files that were read stay in memory until there is need of it.
        let files = read_to_string("/sys/fs/cgroup/memory.stat").ok();
        let files = files.and_then(|text| after(&text, "inactive_file ")?.parse().ok()).unwrap_or(0);
        most.saturating_sub(taken.saturating_sub(files))
    });
    Some(left.map_or(free, |left| left.min(free)))
}

/// What follows a name at the beginning of a line.
fn after<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.lines().find_map(|line| line.strip_prefix(name)).map(str::trim)
}

/// The bytes in a line such as `MemAvailable: 1024 kB`.
fn kilobytes(text: &str, name: &str) -> Option<u64> {
    after(text, name)?.strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_meminfo_are_bytes() {
        let text = "MemTotal:       24546744 kB\nMemFree:  1 kB\nMemAvailable:   23456789 kB\n";
        assert_eq!(kilobytes(text, "MemAvailable:"), Some(23_456_789 * 1024));
        assert_eq!(kilobytes(text, "MemOther:"), None);
        for odd in ["MemAvailable: 12", "MemAvailable: many kB", "MemAvailable: 99999999999999999999 kB", ""]
        {
            assert_eq!(kilobytes(odd, "MemAvailable:"), None, "{odd}");
        }
    }
}

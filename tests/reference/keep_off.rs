//! The clearance of targets from curves.

use super::sizing::Site;
use glam::DVec3;

/// Neighbours that count.
pub const NEAR: usize = 12;

/// Where the target `to` of an interior site may go: off the lines of the curve sites among its nearest ones
/// `around`, which have it at least at 0.45 of how far they go on.
pub fn kept_off(own: &Site, around: &[&Site], spacing: f64, to: DVec3) -> DVec3 {
    let n = own.normal;
    let mut push = DVec3::ZERO;
    for other in around.iter().take(NEAR) {
        let Some((direction, reach)) = other.mark.line() else { continue };
        let faces = other.mark.counts_anywhere() || n.dot(other.normal) > -0.2;
        let reach = reach * spacing * other.length;
        let across = |p: DVec3| p - other.at - direction * (p - other.at).dot(direction);
        let away = across(own.at) - n * across(own.at).dot(n);
        if !faces || away.length() < 1e-5 * spacing {
            continue;
        }
        let away = away.normalize();
        let off = to - other.at;
        let missing = 0.45 * reach - off.dot(away);
        if off.dot(direction).abs() <= reach && missing > 0.0 {
            push += away * (missing - push.dot(away)).max(0.0);
        }
    }
    to + push
}

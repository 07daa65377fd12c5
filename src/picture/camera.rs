//! The camera: where a mesh is seen from.

use crate::mesh::unit_frame::UnitFrame;
use crate::{Result, TriMesh};
use glam::{DMat3, DVec3};

/// Distance of the camera in radii of the mesh: a weak perspective.
const DISTANCE: f64 = 5.0;
/// At least the width of lines, in pixels.
const LINE_WIDTH: f64 = 4.0;
/// Margin around the mesh, as a share of the panel.
const MARGIN: f64 = 0.04;

/// The direction from which a mesh is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rotation around the up axis in degrees; 0 looks along -z with y up, 90 from +x.
    pub azimuth: f64,
    /// Height above the horizon in degrees, -90 to 90.
    pub elevation: f64,
    /// Enlargement; 1 shows the whole mesh.
    pub zoom: f64,
    /// Whether z is up, as in CAD, and not y.
    pub z_up: bool,
}

impl Default for View {
    fn default() -> Self {
        Self { azimuth: 25.0, elevation: 15.0, zoom: 1.0, z_up: false }
    }
}

/// Projects points onto a panel.
pub(super) struct Camera {
    frame: UnitFrame,
    rotation: DMat3,
    /// Radius of the ball around the mesh in the unit-diagonal frame.
    radius: f64,
    /// Pixels per radius at the centre.
    pixels: f64,
    size: [f64; 2],
}

/// A point projected onto a panel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Projected {
    /// Pixels to the right and down.
    pub at: [f64; 2],
    /// In radii, towards the camera.
    pub depth: f64,
}

impl Camera {
    /// A camera that sees the whole mesh.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for a mesh without a size.
    pub fn around(mesh: &TriMesh, view: &View, size: [u32; 2]) -> Result<Self> {
        let frame = UnitFrame::of(mesh)?;
        let radius =
            mesh.vertices.iter().map(|v| frame.to_unit(*v).length()).fold(f64::MIN_POSITIVE, f64::max);
        let upright =
            if view.z_up { DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y) } else { DMat3::IDENTITY };
        let rotation = DMat3::from_rotation_x(view.elevation.to_radians())
            * DMat3::from_rotation_y(-view.azimuth.to_radians())
            * upright;
        let size = size.map(f64::from);
        let mut camera = Self { frame, rotation, radius, pixels: 1.0, size };
        // The mesh may be narrower than the ball around it.
        let ends = mesh.vertices.iter().map(|v| camera.project(*v).at);
        let most = ends.fold([f64::MIN_POSITIVE; 2], |most, at| {
            [0, 1].map(|k: usize| most[k].max((at[k] - 0.5 * size[k]).abs()))
        });
        let fits = [0, 1].map(|k: usize| (0.5 - MARGIN) * size[k] / most[k]);
        camera.pixels = fits[0].min(fits[1]) * view.zoom;
        Ok(camera)
    }

    pub fn project(&self, point: DVec3) -> Projected {
        let p = self.rotation * self.frame.to_unit(point) / self.radius;
        let scale = self.pixels * DISTANCE / (DISTANCE - p.z).max(0.1);
        Projected { at: [0.5 * self.size[0] + scale * p.x, 0.5 * self.size[1] - scale * p.y], depth: p.z }
    }

    /// Whether any of what has these corners may be in the panel, with lines of usual width.
    pub fn may_see(&self, corners: [Projected; 3]) -> bool {
        [0, 1].iter().all(|k: &usize| {
            let [a, b, c] = corners.map(|corner| corner.at[*k]);
            a.max(b).max(c) >= -LINE_WIDTH && a.min(b).min(c) <= self.size[*k] + LINE_WIDTH
        })
    }

    /// The directions to the right and up.
    pub fn sideways(&self) -> (DVec3, DVec3) {
        let back = self.rotation.transpose();
        (back.x_axis, back.y_axis)
    }

    /// A direction as the camera sees it: x to the right, y up, z towards it.
    pub fn direction(&self, direction: DVec3) -> DVec3 {
        self.rotation * direction
    }
}

//! How sites return to the surface, and where their tangent planes come from, in runs with all sites from the
//! start.

use crate::gpu::{Buffer, Device, Recorder};
use crate::mesh::bvh::Bvh;
use crate::mesh::spacing;
use crate::options::Options;
use crate::options::{Normals, Projection};
use crate::sites::on_surface::SitesOnSurface;
use crate::sites::surface::{Surface, SurfaceBuffers};
use crate::stages::neighbours::knn::{Nearest, TileBounds};
use crate::stages::normals::PlaneFit;
use crate::stages::project::best_fit::BestFit;
use crate::stages::project::bvh::Bvh as DeviceBvh;
use crate::stages::project::closest::ClosestPoints;
use crate::stages::project::nearest_vertices::NearestVertices;
use crate::stages::project::walk::Walk;
use crate::stages::records::TriangleRecords;
use crate::{Error, Result};
use glam::{DVec3, Vec4};
use rayon::prelude::*;

/// The stages of projection and planes, with their buffers.
pub(crate) struct SiteProjection {
    planes: Planes,
    site_triangle: Buffer<u32>,
    surface: SurfaceBuffers,
}

/// The source of tangent planes, and the target of the projection.
enum Planes {
    /// Planes fit the sites.
    Sites(PlaneFit, Onto),
    /// Planes fit vertices of the input; sites are projected onto these planes or onto something else.
    Cloud(NearVertices, BestFit, Option<Onto>),
    /// Planes come with the walk; the flags are reset in every iteration.
    Surface(Triangles, Buffer<u32>),
}

/// Target of the projection.
enum Onto {
    /// Triangles around the nearest vertices.
    Vertices(NearVertices, NearestVertices),
    Triangles(Triangles),
}

/// Triangles found by a walk, and a search beyond it.
struct Triangles {
    records: TriangleRecords,
    walk: Walk,
    farther: Option<(DeviceBvh, ClosestPoints)>,
}

/// The nearest vertices of the input.
struct NearVertices {
    tiles: TileBounds,
    nearest: Nearest,
}

impl NearVertices {
    fn new(device: &Device, surface: &Surface, options: &Options) -> Result<Self> {
        let (sites, k) = (options.vertices, options.all_at_once.k_project);
        Ok(Self {
            tiles: TileBounds::new(device, "rtf.neighbours.vertex_tiles", surface.vertices.len())?,
            nearest: Nearest::new(device, "rtf.neighbours.vertices", sites, k, false, None)?,
        })
    }

    /// Records the work that is done once for the surface.
    fn begin(&self, recorder: &mut Recorder, surface: &SurfaceBuffers) -> Result<()> {
        self.tiles.record(recorder, &surface.vertices)
    }

    fn record(
        &self,
        recorder: &mut Recorder,
        targets: &Buffer<Vec4>,
        surface: &SurfaceBuffers,
    ) -> Result<()> {
        self.nearest.record(recorder, targets, &surface.vertices, &self.tiles)
    }
}

impl Triangles {
    fn new(device: &Device, surface: &Surface, options: &Options) -> Result<Self> {
        let farther = match options.all_at_once.projection {
            Projection::Exact => {
                let tree = DeviceBvh::new(device, surface.triangles.len(), None)?;
                Some((tree, ClosestPoints::new(device, None)?))
            }
            _ => None,
        };
        Ok(Self {
            records: TriangleRecords::new(device, surface, None)?,
            walk: Walk::new(device, options.vertices, None)?,
            farther,
        })
    }

    fn begin(&self, recorder: &mut Recorder) -> Result<()> {
        self.farther.as_ref().map_or(Ok(()), |(tree, _)| tree.record(recorder, &self.records))
    }

    fn record(
        &self,
        recorder: &mut Recorder,
        targets: &Buffer<Vec4>,
        site_triangles: &Buffer<u32>,
    ) -> Result<()> {
        let Self { records, walk, farther } = self;
        walk.record(recorder, targets, records, site_triangles)?;
        match farther {
            Some((tree, closest)) => {
                closest.record(recorder, targets, records, tree, walk.into(), site_triangles)
            }
            None => Ok(()),
        }
    }
}

impl Onto {
    /// `None` for [`Projection::Plane`].
    fn new(device: &Device, surface: &Surface, options: &Options) -> Result<Option<Self>> {
        Ok(match options.all_at_once.projection {
            Projection::Plane => None,
            Projection::NearestVertices => {
                let near = NearVertices::new(device, surface, options)?;
                let project =
                    NearestVertices::new(device, options.vertices, options.all_at_once.k_project, None)?;
                Some(Self::Vertices(near, project))
            }
            Projection::Walk | Projection::Exact => {
                Some(Self::Triangles(Triangles::new(device, surface, options)?))
            }
        })
    }

    /// Records the work that is done once for the surface.
    fn begin(&self, recorder: &mut Recorder, surface: &SurfaceBuffers) -> Result<()> {
        match self {
            Self::Vertices(near, _) => near.begin(recorder, surface),
            Self::Triangles(triangles) => triangles.begin(recorder),
        }
    }

    fn record(
        &self,
        recorder: &mut Recorder,
        surface: &SurfaceBuffers,
        targets: &Buffer<Vec4>,
        site_triangles: &Buffer<u32>,
    ) -> Result<&Buffer<Vec4>> {
        match self {
            Self::Vertices(near, project) => {
                near.record(recorder, targets, surface)?;
                project.record(recorder, targets, &near.nearest.neighbours, surface, site_triangles)?;
                Ok(&project.projected)
            }
            Self::Triangles(triangles) => {
                triangles.record(recorder, targets, site_triangles)?;
                Ok(&triangles.walk.projected)
            }
        }
    }
}

impl SiteProjection {
    /// For sites that start at `seeds`.
    pub fn new(
        device: &Device,
        options: &Options,
        surface: &Surface,
        seeds: &SitesOnSurface,
    ) -> Result<Self> {
        let n = options.vertices;
        let planes = match options.all_at_once.normals {
            Normals::Fit => {
                let fit = PlaneFit::new(device, n, options.all_at_once.k_normal, None)?;
                let onto = Onto::new(device, surface, options)?;
                let onto = onto
                    .ok_or_else(|| Error::Internal("no projection for planes that fit the sites".into()))?;
                Planes::Sites(fit, onto)
            }
            Normals::Surface => {
                let flags = Buffer::new(device, "rtf.normals.flags", n)?;
                Planes::Surface(Triangles::new(device, surface, options)?, flags)
            }
            Normals::Cloud => {
                let near = NearVertices::new(device, surface, options)?;
                let of = (options.all_at_once.k_project, spacing(surface.area(), n));
                let fit = BestFit::new(device, surface, n, of, None)?;
                Planes::Cloud(near, fit, Onto::new(device, surface, options)?)
            }
        };
        let site_triangle = Buffer::from_slice(device, "rtf.site_triangle", &seeds.triangles)?;
        Ok(Self { planes, site_triangle, surface: SurfaceBuffers::new(device, surface)? })
    }

    /// The work that is done once: searches get their boxes, and `sites` their first planes if those come
    /// with the projection. Sites that are projected onto planes move there.
    ///
    /// # Errors
    /// Those of the device.
    pub fn begin(&self, device: &Device, sites: &Buffer<Vec4>) -> Result<()> {
        let mut recorder = Recorder::new(device)?;
        match &self.planes {
            Planes::Sites(_, onto) => onto.begin(&mut recorder, &self.surface)?,
            Planes::Surface(triangles, _) => triangles.begin(&mut recorder)?,
            Planes::Cloud(near, _, onto) => {
                near.begin(&mut recorder, &self.surface)?;
                if let Some(onto) = onto {
                    onto.begin(&mut recorder, &self.surface)?;
                }
            }
        }
        match &self.planes {
            Planes::Sites(..) => recorder.submit().map(drop),
            Planes::Cloud(_, _, None) => {
                let projected = self.record(&mut recorder, sites)?;
                let projected = recorder.download(projected)?;
                let done = recorder.submit()?;
                let pulled = done.view(&projected)?.iter().map(|p| p.truncate().extend(0.0));
                sites.write(device, &pulled.collect::<Vec<Vec4>>())
            }
            Planes::Surface(..) | Planes::Cloud(..) => {
                self.record(&mut recorder, sites)?;
                recorder.submit().map(drop)
            }
        }
    }

    /// Records the projection of `targets` onto the surface, with the planes that come with it; returns the
    /// projected points.
    pub fn record(&self, recorder: &mut Recorder, targets: &Buffer<Vec4>) -> Result<&Buffer<Vec4>> {
        let Self { planes, site_triangle: site_triangles, surface } = self;
        match planes {
            Planes::Sites(_, onto) => onto.record(recorder, surface, targets, site_triangles),
            Planes::Surface(triangles, _) => {
                triangles.record(recorder, targets, site_triangles)?;
                Ok(&triangles.walk.projected)
            }
            Planes::Cloud(near, planes, onto) => {
                near.record(recorder, targets, surface)?;
                planes.record(recorder, targets, &near.nearest.neighbours, surface)?;
                match onto {
                    None => Ok(&planes.projected),
                    Some(onto) => onto.record(recorder, surface, targets, site_triangles),
                }
            }
        }
    }

    /// Records the planes of `sites` if they do not come with the projection; `near` are their nearest ones.
    pub fn record_planes(
        &self,
        recorder: &mut Recorder,
        sites: &Buffer<Vec4>,
        near: &Buffer<u32>,
    ) -> Result<()> {
        match &self.planes {
            Planes::Sites(fit, _) => {
                fit.record(recorder, sites, near, &self.site_triangle, &self.surface.normals)
            }
            Planes::Surface(_, flags) => recorder.fill(flags, 0),
            Planes::Cloud(..) => Ok(()),
        }
    }

    /// The triangle of the surface that each site is on.
    pub fn site_triangle(&self) -> &Buffer<u32> {
        &self.site_triangle
    }

    /// Unit normals of the planes, w = 0.
    pub fn normals(&self) -> &Buffer<Vec4> {
        match &self.planes {
            Planes::Sites(fit, _) => &fit.normals,
            Planes::Surface(triangles, _) => &triangles.walk.normals,
            Planes::Cloud(_, planes, _) => &planes.normals,
        }
    }

    /// Flags ([`crate::stages::flags`]).
    pub fn flags(&self) -> &Buffer<u32> {
        match &self.planes {
            Planes::Sites(fit, _) => &fit.flags,
            Planes::Surface(_, flags) => flags,
            Planes::Cloud(_, planes, _) => &planes.flags,
        }
    }

    /// How many sites' walks were stopped in the last iteration.
    ///
    /// # Errors
    /// Those of the device.
    pub fn stopped_walks(&self, device: &Device) -> Result<usize> {
        let onto = match &self.planes {
            Planes::Surface(triangles, _) => Some(triangles),
            Planes::Sites(_, Onto::Triangles(triangles))
            | Planes::Cloud(_, _, Some(Onto::Triangles(triangles))) => Some(triangles),
            Planes::Sites(..) | Planes::Cloud(..) => None,
        };
        onto.map_or(Ok(0), |triangles| Ok(Walk::stopped(&triangles.walk.normals.to_vec(device)?)))
    }

    /// The triangles that `sites`, the current ones, lie on.
    ///
    /// # Errors
    /// Those of the device.
    pub fn triangles(&self, device: &Device, surface: &Surface, sites: &[DVec3]) -> Result<Vec<u32>> {
        match &self.planes {
            // The nearer sheet of a thin wall may be the other one.
            Planes::Cloud(_, planes, None) => {
                let normals = planes.normals.to_vec(device)?;
                let bvh = Bvh::new(&surface.mesh());
                let closest = |rank: &mut _, (p, side): (&DVec3, &Vec4)| {
                    let side = side.truncate().as_dvec3();
                    let agrees = |t: u32| surface.normals[t as usize].dot(side) > 0.0;
                    bvh.closest_accepted(*p, rank, agrees)
                        .or_else(|| bvh.closest(*p))
                        .map_or(0, |closest| closest.triangle)
                };
                Ok(sites.par_iter().zip(&normals).map_init(|| 0, closest).collect())
            }
            _ => self.site_triangle.to_vec(device),
        }
    }
}

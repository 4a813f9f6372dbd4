//! Reads the Python descriptions (frozen dataclasses) into the core's values.

use std::collections::HashMap;

use glam::DVec3;
use numpy::ndarray::ArrayView1;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use rayon::prelude::*;

use super::kind::one_of;
use crate::cloth::spec::{ClothSpec, YarnKind, YarnShape, YarnSpec};
use crate::control::Control;
use crate::error::{Error, Result};
use crate::math::color::Rgb;
use crate::memory;
use crate::render::camera::{Camera, Projection};
use crate::render::light::{Environment, Light, Rectangle};
use crate::render::scene::{Material, Materials};
use crate::scatter::body::BodyKind;
use crate::scatter::ggx::Ggx;
use crate::scatter::ply::{PlyBsdf, PlyParameters};
use crate::weave::pattern::WeavePattern;

/// Copies of a pattern, a byte a crossing, that are made at most until it is relaxed: this one, that
/// counted from the bottom, and the relaxation's.
const COPIES: usize = 3;

type Triple = [f64; 3];

/// `plycloth.PlyBsdf`.
#[derive(FromPyObject, PartialEq)]
pub struct PlyBsdfDescription {
    eta: f64,
    specular_tint: Triple,
    transmission_tint: Triple,
    base_color: Triple,
    transmitted_color: Triple,
    body_reflection: f64,
    extinction: f64,
    roughness: [f64; 2],
    exit_roughness: [f64; 2],
    body: String,
}

impl PlyBsdfDescription {
    /// The core's parameters, with `tint` on the colours that a yarn's dye changes.
    pub fn parameters(&self, tint: Rgb) -> Result<PlyParameters> {
        let ggx = |[along, across]: [f64; 2]| Ggx { along, across };
        PlyParameters {
            eta: self.eta,
            specular_tint: self.specular_tint.into(),
            transmission_tint: tint * Rgb::from(self.transmission_tint),
            base_color: tint * Rgb::from(self.base_color),
            transmitted_color: tint * Rgb::from(self.transmitted_color),
            body_reflection: self.body_reflection,
            extinction: self.extinction,
            roughness: ggx(self.roughness),
            exit_roughness: ggx(self.exit_roughness),
            body: body_kind(&self.body)?,
        }
        .checked()
    }
}

/// The form of the body reflection that `name` stands for.
pub fn body_kind(name: &str) -> Result<BodyKind> {
    match name {
        "conserving" => Ok(BodyKind::Conserving),
        "printed" => Ok(BodyKind::Printed),
        other => {
            let problem = format!("is '{other}', but must be 'conserving' or 'printed'");
            Err(Error::invalid("body", problem))
        }
    }
}

/// `plycloth.DiffuseBsdf`.
#[derive(FromPyObject, PartialEq)]
pub struct DiffuseDescription {
    reflectance: Triple,
}

/// A BSDF of any kind.
#[derive(PartialEq)]
enum BsdfDescription {
    Ply(PlyBsdfDescription),
    Diffuse(DiffuseDescription),
}

impl BsdfDescription {
    fn read(place: &str, object: &Bound<'_, PyAny>) -> PyResult<Self> {
        one_of(
            place,
            object,
            &[
                ("PlyBsdf", |object| Ok(Self::Ply(object.extract()?))),
                ("DiffuseBsdf", |object| Ok(Self::Diffuse(object.extract()?))),
            ],
        )
    }

    fn material(&self, tint: Rgb) -> Result<Material> {
        match self {
            Self::Ply(ply) => Ok(Material::Ply(Box::new(PlyBsdf::new(ply.parameters(tint)?)?))),
            Self::Diffuse(DiffuseDescription { reflectance }) => {
                Ok(Material::Diffuse { reflectance: tint * Rgb::from(*reflectance) })
            }
        }
    }
}

#[derive(FromPyObject)]
struct RoundDescription {
    radius_mm: f64,
    thickness: f64,
    collision_radius: f64,
    plies: usize,
    pitch: f64,
    ply_radius: f64,
}

#[derive(FromPyObject)]
struct FlatDescription {
    width_mm: f64,
    thickness: f64,
}

impl From<RoundDescription> for YarnShape {
    fn from(yarn: RoundDescription) -> Self {
        Self::Round {
            radius: yarn.radius_mm,
            thickness: yarn.thickness,
            collision: yarn.collision_radius,
            plies: yarn.plies,
            ply_radius: yarn.ply_radius,
            pitch: yarn.pitch,
        }
    }
}

impl From<FlatDescription> for YarnShape {
    fn from(yarn: FlatDescription) -> Self {
        Self::Flat { width: yarn.width_mm, thickness: yarn.thickness }
    }
}

/// A yarn of any kind: its shape is read from the same object as the rest.
struct YarnDescription {
    shape: YarnShape,
    bsdf: BsdfDescription,
    stiffness: f64,
}

impl YarnDescription {
    fn read(place: &str, object: &Bound<'_, PyAny>) -> PyResult<Self> {
        let shape = one_of(
            place,
            object,
            &[
                ("RoundYarn", |yarn| Ok(yarn.extract::<RoundDescription>()?.into())),
                ("FlatYarn", |yarn| Ok(yarn.extract::<FlatDescription>()?.into())),
            ],
        )?;
        Ok(Self {
            shape,
            bsdf: BsdfDescription::read(&format!("{place}.bsdf"), &object.getattr("bsdf")?)?,
            stiffness: object.getattr("stiffness")?.extract()?,
        })
    }

    /// Those of a tuple of kinds; if there are several, errors number them.
    fn read_all(place: &str, kinds: &Bound<'_, PyAny>) -> PyResult<Vec<Self>> {
        let alone = kinds.len()? == 1;
        let read = |(number, kind): (usize, PyResult<Bound<'_, PyAny>>)| {
            let numbered = format!("{place}_kinds[{number}]");
            Self::read(if alone { place } else { &numbered }, &kind?)
        };
        kinds.try_iter()?.enumerate().map(read).collect()
    }
}

#[derive(FromPyObject)]
struct PatternDescription<'py> {
    warp_up: PyReadonlyArray2<'py, bool>,
}

/// `plycloth.Fabric`.
pub struct FabricDescription<'py> {
    pattern: PatternDescription<'py>,
    warp_kinds: Vec<YarnDescription>,
    weft_kinds: Vec<YarnDescription>,
    end_kind: PyReadonlyArray1<'py, u32>,
    pick_kind: PyReadonlyArray1<'py, u32>,
    end_spacing: PyReadonlyArray1<'py, f64>,
    pick_spacing: PyReadonlyArray1<'py, f64>,
    warp_colors: Option<PyReadonlyArray2<'py, f64>>,
    weft_colors: Option<PyReadonlyArray2<'py, f64>>,
    collision_stiffness: f64,
}

impl<'a, 'py> FromPyObject<'a, 'py> for FabricDescription<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self {
            pattern: object.getattr("pattern")?.extract()?,
            warp_kinds: YarnDescription::read_all("Fabric.warp", &object.getattr("warp_kinds")?)?,
            weft_kinds: YarnDescription::read_all("Fabric.weft", &object.getattr("weft_kinds")?)?,
            end_kind: object.getattr("end_kind")?.extract()?,
            pick_kind: object.getattr("pick_kind")?.extract()?,
            end_spacing: object.getattr("end_spacing")?.extract()?,
            pick_spacing: object.getattr("pick_spacing")?.extract()?,
            warp_colors: object.getattr("warp_colors")?.extract()?,
            weft_colors: object.getattr("weft_colors")?.extract()?,
            collision_stiffness: object.getattr("collision_stiffness")?.extract()?,
        })
    }
}

impl FabricDescription<'_> {
    /// The cloth's geometry; [`Error::OutOfMemory`] if there is no room for it.
    pub fn cloth(&self) -> Result<ClothSpec> {
        let warp_up = self.pattern.warp_up.as_array();
        let (picks, ends) = warp_up.dim();
        let work = format!("describing {picks} picks x {ends} ends");
        memory::claim(&work, COPIES.saturating_mul(warp_up.len()))?;
        let kind =
            |yarn: &YarnDescription| YarnKind { shape: yarn.shape, stiffness: yarn.stiffness };
        let set = |kinds: &[YarnDescription],
                   kind_of: &PyReadonlyArray1<'_, u32>,
                   spacing: &PyReadonlyArray1<'_, f64>| YarnSpec {
            kinds: kinds.iter().map(kind).collect(),
            kind_of: kind_of.as_array().to_vec(),
            spacing: spacing.as_array().to_vec(),
        };
        ClothSpec {
            pattern: WeavePattern { picks, ends, warp_up: warp_up.iter().copied().collect() },
            warp: set(&self.warp_kinds, &self.end_kind, &self.end_spacing),
            weft: set(&self.weft_kinds, &self.pick_kind, &self.pick_spacing),
            collision_stiffness: self.collision_stiffness,
        }
        .checked()
    }

    /// The BSDF and colour of each material: one for each different pair among the ends, and among the
    /// picks.
    pub fn palette(&self) -> Palette<'_> {
        let mut dyed = Vec::new();
        let warp = dye(&mut dyed, &self.warp_kinds, &self.end_kind, self.warp_colors.as_ref());
        let mut weft = dye(&mut dyed, &self.weft_kinds, &self.pick_kind, self.weft_colors.as_ref());
        weft.reverse();
        Palette { dyed, of_yarn: [warp, weft] }
    }
}

/// The materials of a fabric, before they are prepared.
pub struct Palette<'a> {
    dyed: Vec<(&'a BsdfDescription, Rgb)>,
    /// The number of each end's and each pick's (counted from the bottom).
    of_yarn: [Vec<u32>; 2],
}

impl Palette<'_> {
    /// Prepares them.
    pub fn materials(self, control: &Control) -> Result<Materials> {
        let prepared = |(bsdf, color): &(&BsdfDescription, Rgb)| {
            control.check()?;
            bsdf.material(*color)
        };
        let list = self.dyed.par_iter().map(prepared).collect::<Result<_>>()?;
        Ok(Materials { list, of_yarn: self.of_yarn })
    }
}

/// Adds the BSDFs of `kinds` with each of their different colours to `dyed`; answers the number of each
/// yarn's.
fn dye<'a>(
    dyed: &mut Vec<(&'a BsdfDescription, Rgb)>,
    kinds: &'a [YarnDescription],
    kind_of: &PyReadonlyArray1<'_, u32>,
    colors: Option<&PyReadonlyArray2<'_, f64>>,
) -> Vec<u32> {
    // Kinds that differ in shape alone share materials.
    let first_alike = |kind: &YarnDescription| kinds.iter().position(|k| k.bsdf == kind.bsdf);
    let bsdfs: Vec<_> = kinds.iter().filter_map(first_alike).collect();
    let mut numbers: HashMap<(usize, [u64; 3]), u32> = HashMap::new();
    let kind_of = kind_of.as_array();
    let material = |(yarn, &kind): (usize, &u32)| {
        let color = colors.map_or(Rgb::ONE, |colors| {
            Rgb::from_array([0, 1, 2].map(|channel| colors.as_array()[[yarn, channel]]))
        });
        let bsdf = bsdfs[kind as usize];
        *numbers.entry((bsdf, color.to_array().map(f64::to_bits))).or_insert_with(|| {
            dyed.push((&kinds[bsdf].bsdf, color));
            dyed.len() as u32 - 1
        })
    };
    kind_of.iter().enumerate().map(material).collect()
}

#[derive(FromPyObject)]
struct PerspectiveDescription {
    fov: f64,
}

#[derive(FromPyObject)]
struct OrthographicDescription {
    width_mm: f64,
}

impl From<PerspectiveDescription> for Projection {
    fn from(camera: PerspectiveDescription) -> Self {
        Self::Perspective { tan_half_fov: (0.5 * camera.fov.to_radians()).tan() }
    }
}

impl From<OrthographicDescription> for Projection {
    fn from(camera: OrthographicDescription) -> Self {
        Self::Orthographic { width: camera.width_mm }
    }
}

/// A camera of any kind.
pub fn camera(place: &str, object: &Bound<'_, PyAny>) -> PyResult<Camera> {
    let projection = one_of(
        place,
        object,
        &[
            ("PerspectiveCamera", |it| Ok(it.extract::<PerspectiveDescription>()?.into())),
            ("OrthographicCamera", |it| Ok(it.extract::<OrthographicDescription>()?.into())),
        ],
    )?;
    let vector = |name: &str| -> PyResult<DVec3> {
        Ok(DVec3::from_array(object.getattr(name)?.extract::<Triple>()?))
    };
    let resolution = object.getattr("resolution")?.extract()?;
    let (origin, target, up) = (vector("origin")?, vector("target")?, vector("up")?);
    Ok(Camera::new(origin, target, up, projection, resolution)?)
}

/// What the camera of a scene sees behind the cloth, if that is not the lights.
pub fn background(scene: &Bound<'_, PyAny>) -> PyResult<Option<Rgb>> {
    let color: Option<Triple> = scene.getattr("background")?.extract()?;
    Ok(color.map(Rgb::from))
}

#[derive(FromPyObject)]
struct PointDescription {
    position: Triple,
    intensity: Triple,
}

#[derive(FromPyObject)]
struct DirectionalDescription {
    direction: Triple,
    irradiance: Triple,
}

#[derive(FromPyObject)]
struct RectangleDescription {
    center: Triple,
    edge_u: Triple,
    edge_v: Triple,
    radiance: Triple,
}

#[derive(FromPyObject)]
struct ConstantDescription {
    radiance: Triple,
}

#[derive(FromPyObject)]
struct EnvironmentDescription<'py> {
    image: PyReadonlyArray3<'py, f32>,
    scale: f64,
    rotation: f64,
}

impl From<PointDescription> for Light {
    fn from(light: PointDescription) -> Self {
        Self::Point { position: light.position.into(), intensity: light.intensity.into() }
    }
}

impl From<DirectionalDescription> for Light {
    fn from(light: DirectionalDescription) -> Self {
        Self::Directional {
            direction: DVec3::from(light.direction).normalize(),
            irradiance: light.irradiance.into(),
        }
    }
}

impl From<RectangleDescription> for Light {
    fn from(light: RectangleDescription) -> Self {
        let edges = [light.edge_u.into(), light.edge_v.into()];
        Self::Rectangle(Rectangle::new(light.center.into(), edges, light.radiance.into()))
    }
}

impl From<ConstantDescription> for Light {
    fn from(light: ConstantDescription) -> Self {
        Self::Constant { radiance: light.radiance.into() }
    }
}

impl From<EnvironmentDescription<'_>> for Light {
    fn from(light: EnvironmentDescription<'_>) -> Self {
        Self::Environment(environment(&light))
    }
}

/// A light of any kind.
pub fn light(place: &str, object: &Bound<'_, PyAny>) -> PyResult<Light> {
    one_of(
        place,
        object,
        &[
            ("PointLight", |it| Ok(it.extract::<PointDescription>()?.into())),
            ("DirectionalLight", |it| Ok(it.extract::<DirectionalDescription>()?.into())),
            ("RectangleLight", |it| Ok(it.extract::<RectangleDescription>()?.into())),
            ("ConstantLight", |it| Ok(it.extract::<ConstantDescription>()?.into())),
            ("EnvironmentLight", |it| Ok(it.extract::<EnvironmentDescription<'_>>()?.into())),
        ],
    )
}

fn environment(light: &EnvironmentDescription<'_>) -> Environment {
    let image = light.image.as_array();
    let color = |row: ArrayView1<f32>| Rgb::from_array([0, 1, 2].map(|c| f64::from(row[c])));
    let pixels = image.rows().into_iter().map(|row| light.scale * color(row));
    Environment::new(pixels.collect(), image.dim().1, light.rotation.to_radians())
}

//! The path tracer: next-event estimation with multiple importance sampling at every x and y.

use glam::DVec3;

use super::light::LightSample;
use super::scene::{Contact, Exit, Inside, Interaction, Material, Scene};
use crate::accel::ray::Ray;
use crate::math::color::Rgb;
use crate::math::frame::Frame;
use crate::math::rng::Sampler;
use crate::sampling::warp::{square_to_cosine_hemisphere, square_to_cosine_hemisphere_pdf};
use crate::scatter::aim::Aim;
use crate::scatter::passage::Passage;
use crate::scatter::ply::{Choice, Crossing, PlyBsdf};

/// How far paths are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathLimits {
    /// Segments of a path: 1 sees lights alone, 2 adds direct light. A ply counts once, whether the
    /// light bounces off it or passes through.
    pub max_depth: u32,
    /// Segments before Russian roulette sets in.
    pub roulette_depth: u32,
    /// Whether light is looked for on both sides of every ply, rather than beyond those alone that
    /// the path goes through: less noise where light comes from behind, for one more shadow ray.
    pub both_sides: bool,
    /// How likely every lobe is at least that some parameters switch on, 0 to 1/4: paths that are to
    /// be evaluated for other parameters must not miss what is dark for those that they are drawn by.
    pub lobe_floor: f64,
}

/// The side of a yarn on which light is scattered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// At x, where it entered.
    Entry,
    /// At y, where it leaves.
    Exit,
    /// At y, where it goes straight on into a ply that touches.
    Straight,
}

/// Takes note of a path as it is traced.
pub trait Recorder {
    /// The path meets a yarn.
    fn vertex(&mut self, material: u32, wo: DVec3, passage: Option<&Passage>);
    /// Light of the given weight reaches the last vertex from local direction `wi`.
    fn light(&mut self, side: Side, wi: DVec3, weight: Rgb);
    /// The path goes on in local direction `wi` with the given weight.
    fn scatter(&mut self, side: Side, wi: DVec3, weight: f64);
    /// The path ends in a light of the given weight.
    fn emitted(&mut self, weight: Rgb);
}

/// Takes no note.
pub struct NoRecorder;

impl Recorder for NoRecorder {
    #[inline]
    fn vertex(&mut self, _: u32, _: DVec3, _: Option<&Passage>) {}
    #[inline]
    fn light(&mut self, _: Side, _: DVec3, _: Rgb) {}
    #[inline]
    fn scatter(&mut self, _: Side, _: DVec3, _: f64) {}
    #[inline]
    fn emitted(&mut self, _: Rgb) {}
}

/// Where a path goes on.
struct Next {
    ray: Ray,
    side: Side,
    /// The same direction in the local frame.
    wi: DVec3,
    /// What the vertex makes of the light from there.
    value: Rgb,
    /// The density of the direction, given the side.
    pdf: f64,
    /// The probability of having come to this side at all.
    chance: f64,
    /// What is met at once, if the light does not go into the air.
    contact: Option<Box<Contact>>,
}

/// Random numbers that choose a light, and a point on it.
type LightNumber = (f64, [f64; 2]);

/// A path under way.
struct Path<'a, R> {
    scene: &'a Scene,
    sampler: Sampler,
    recorder: &'a mut R,
    limits: PathLimits,
    throughput: Rgb,
    /// The throughput that roulette goes by: lobes that are dark, but have a floor, count as one.
    promise: Rgb,
    radiance: Rgb,
}

/// One sample of the radiance that arrives along `ray`.
pub fn radiance<R: Recorder>(
    scene: &Scene,
    ray: Ray,
    limits: PathLimits,
    sampler: Sampler,
    recorder: &mut R,
) -> Rgb {
    let (throughput, promise, radiance) = (Rgb::ONE, Rgb::ONE, Rgb::ZERO);
    let mut path = Path { scene, sampler, recorder, limits, throughput, promise, radiance };
    path.trace(ray);
    path.radiance
}

impl<R: Recorder> Path<'_, R> {
    fn trace(&mut self, mut ray: Ray) {
        let (mut scattered_pdf, mut contact) = (None, None::<Box<Contact>>);
        for depth in 1.. {
            let interaction = match contact {
                Some(contact) => self.scene.through(&ray, *contact),
                None => match self.meet(&ray, scattered_pdf) {
                    Some(interaction) => interaction,
                    None => return,
                },
            };
            if depth >= self.limits.max_depth {
                return;
            }
            let next = match self.scene.material(interaction.material) {
                Material::Ply(bsdf) => self.at_ply(&interaction, bsdf),
                Material::Diffuse { reflectance } => self.at_diffuse(&interaction, *reflectance),
            };
            let Some(next) = next else { return };
            let weight = 1.0 / (next.pdf * next.chance);
            let Some(survival) = self.survival(next.value * weight, depth) else { return };
            self.recorder.scatter(next.side, next.wi, weight / survival);
            self.throughput *= next.value * (weight / survival);
            (ray, scattered_pdf, contact) = (next.ray, Some(next.pdf), next.contact);
        }
    }

    /// The yarn that the ray meets; if it meets a light or nothing, that light is added.
    #[inline(always)]
    fn meet(&mut self, ray: &Ray, scattered_pdf: Option<f64>) -> Option<Interaction> {
        let hit = self.scene.swatch.nearest(ray);
        let lights = &self.scene.lights;
        if let Some(rectangle) = lights.nearest(ray)
            && hit.is_none_or(|hit| rectangle.0 < hit.t)
        {
            self.add_emitted(lights.emitted(ray, rectangle), scattered_pdf);
            return None;
        }
        if hit.is_none() {
            match self.scene.background {
                Some(background) if scattered_pdf.is_none() => {
                    self.add_emitted((background, 0.0), scattered_pdf);
                }
                _ => {
                    for surroundings in lights.surroundings(ray.direction) {
                        self.add_emitted(surroundings, scattered_pdf);
                    }
                }
            }
        }
        hit.map(|hit| self.scene.interaction(ray, &hit))
    }

    #[inline]
    fn add_emitted(&mut self, (emitted, light_pdf): (Rgb, f64), scattered_pdf: Option<f64>) {
        let weight = scattered_pdf.map_or(1.0, |pdf| balance(pdf, light_pdf));
        self.recorder.emitted(emitted * weight);
        self.radiance += self.throughput * emitted * weight;
    }

    /// The probability that the path lives on, or `None` if it dies.
    #[inline]
    fn survival(&mut self, factor: Rgb, depth: u32) -> Option<f64> {
        let dark = self.limits.lobe_floor > 0.0 && factor == Rgb::ZERO;
        self.promise *= if dark { Rgb::ONE } else { factor };
        let promise = self.promise.max_element();
        if promise <= 0.0 {
            return None;
        }
        let chance = self.sampler.next_1d();
        if depth < self.limits.roulette_depth {
            return Some(1.0);
        }
        // Where plies touch, paths of white ones may stay long: their weight must not grow with it.
        let survival = if promise > 1.0 { 0.99 } else { promise.min(0.95) };
        self.promise /= survival;
        (chance < survival).then_some(survival)
    }

    #[inline(always)]
    fn at_diffuse(&mut self, interaction: &Interaction, reflectance: Rgb) -> Option<Next> {
        let Interaction { material, wo, .. } = *interaction;
        self.recorder.vertex(material, wo, None);
        let pdf = square_to_cosine_hemisphere_pdf;
        let eval = |wi| (reflectance * pdf(wi), pdf(wi));
        let before = self.light_number();
        self.add_light_before(interaction, before, eval);
        let wi = square_to_cosine_hemisphere(self.sampler.next_2d());
        scattered_back(interaction, wi, eval)
    }

    // Not inlined: it is long, and paths through diffuse cloth do without it.
    #[inline(never)]
    fn at_ply(&mut self, interaction: &Interaction, bsdf: &PlyBsdf) -> Option<Next> {
        let Interaction { material, wo, .. } = *interaction;
        let beyond = self.light_number();
        let (passage, exit) = self.pass(interaction, bsdf, beyond).unzip();
        self.recorder.vertex(material, wo, passage.as_ref());
        let before = self.light_number();
        let crossing = bsdf.crossing(wo, passage, self.limits.lobe_floor);
        let eval = |wi| (bsdf.eval_entry(wo, &crossing, wi), bsdf.pdf_entry(wo, &crossing, wi));
        self.add_light_before(interaction, before, eval);
        // The probability of looking for light beyond the ply, and of going on there if so.
        let (passed, both_sides) = (crossing.entry_probabilities[2], self.limits.both_sides);
        let (looked, gone) = if both_sides { (1.0, passed) } else { (passed, 1.0) };
        if let (true, Some(exit)) = (both_sides, &exit) {
            self.add_light_beyond(bsdf, &crossing, exit, beyond, looked, gone);
        }
        match bsdf.sample_entry(wo, &crossing, &mut self.sampler) {
            Choice::Lost => None,
            Choice::Pass => {
                let exit = exit?;
                if !both_sides {
                    self.add_light_beyond(bsdf, &crossing, &exit, beyond, looked, gone);
                }
                self.leave_ply(bsdf, &crossing, exit, beyond, looked, gone)
            }
            Choice::Scatter(wi) => match interaction.contact() {
                None => scattered_back(interaction, wi, eval),
                Some(contact) => {
                    let Interaction { point, frame, .. } = interaction;
                    let (wi, aim) = self.aimed(wi, &contact, *point, frame, before)?;
                    let share = crossing.entry_probabilities[1];
                    scattered_back(interaction, wi, |wi| with_aim(eval(wi), share, &aim, wi))
                }
            },
        }
    }

    /// Refracts light into the ply and follows it to where it comes out.
    #[inline]
    fn pass(
        &mut self,
        interaction: &Interaction,
        bsdf: &PlyBsdf,
        beyond: LightNumber,
    ) -> Option<(Passage, Exit)> {
        let (entry, facet) = (self.sampler.next_2d(), self.sampler.next_2d());
        let enters = interaction.is_in_air();
        let refracted = if enters {
            let aim = self.aim_beyond(interaction, bsdf, beyond);
            bsdf.sample_refracted(interaction.wo, aim.as_ref(), self.limits.lobe_floor, entry)?
        } else {
            (-interaction.wo, 1.0)
        };
        let (Inside { incident, length }, exit) = self.scene.exit(interaction, refracted.0);
        let interfaces = [enters, exit.is_in_air()];
        Some((bsdf.sample_passage(interfaces, refracted, incident, length, facet), exit))
    }

    /// The direction from `point` to the lamp that this number chooses, if it is one that only
    /// connections find.
    #[inline]
    fn lamp(&self, point: DVec3, (choice, u): LightNumber) -> Option<DVec3> {
        let sample = self.scene.lights.sample(point, choice, u)?;
        sample.pdf.is_none().then_some(sample.direction)
    }

    /// What refracted light is aimed at, as if y faced x.
    #[inline]
    fn aim_beyond(
        &self,
        interaction: &Interaction,
        bsdf: &PlyBsdf,
        beyond: LightNumber,
    ) -> Option<Aim> {
        let lamp = interaction.frame.to_local(self.lamp(interaction.point, beyond)?);
        Aim::new(bsdf.exit_from_outside(), Frame::orthonormal(DVec3::Z, DVec3::X), lamp)
    }

    /// Light that a body scatters into `wi` through a contact: half of it is aimed at the lamp that
    /// this number chooses, if there is one on that side. `frame` is that of `wi`.
    #[cold]
    fn aimed(
        &mut self,
        wi: DVec3,
        contact: &Contact,
        point: DVec3,
        frame: &Frame,
        number: LightNumber,
    ) -> Option<(DVec3, Option<Aim>)> {
        let on_its_side = |lamp: &DVec3| lamp.dot(frame.normal()) * wi.z > 0.0;
        let lamp = self.lamp(point, number).filter(on_its_side);
        let aim = lamp.and_then(|lamp| self.scene.aim_through(contact, point, frame, lamp));
        let Some(aim) = aim else { return Some((wi, None)) };
        let (choice, u) = (self.sampler.next_1d(), self.sampler.next_2d());
        let aimed = if choice < 0.5 { wi } else { aim.sample(u)? };
        (aimed.z * wi.z > 0.0).then_some((aimed, Some(aim)))
    }

    #[inline]
    fn light_number(&mut self) -> LightNumber {
        (self.sampler.next_1d(), self.sampler.next_2d())
    }

    /// Adds light that reaches x through the air.
    #[inline]
    fn add_light_before(
        &mut self,
        interaction: &Interaction,
        number: LightNumber,
        eval: impl Fn(DVec3) -> (Rgb, f64),
    ) {
        if interaction.is_in_air() {
            let Interaction { point, frame, .. } = interaction;
            self.add_light(Side::Entry, *point, frame, number, 1.0, eval);
        }
    }

    /// Adds light that reaches y from beyond the ply, if that is the air.
    #[inline]
    fn add_light_beyond(
        &mut self,
        bsdf: &PlyBsdf,
        crossing: &Crossing,
        exit: &Exit,
        number: LightNumber,
        looked: f64,
        gone: f64,
    ) {
        if exit.is_in_air() {
            let eval = |wi| eval_exit(bsdf, crossing, wi, gone);
            self.add_light(Side::Exit, exit.point, &exit.frame, number, looked, eval);
        }
    }

    /// Scatters light that went through the ply, at y.
    #[inline]
    fn leave_ply(
        &mut self,
        bsdf: &PlyBsdf,
        crossing: &Crossing,
        exit: Exit,
        number: LightNumber,
        looked: f64,
        gone: f64,
    ) -> Option<Next> {
        let (passage, terms) = crossing.passage.as_ref()?;
        let contact = exit.contact();
        let (side, wi, (value, pdf)) = match bsdf.sample_exit(passage, crossing, &mut self.sampler)
        {
            Choice::Scatter(wi) => {
                let (wi, aim) = match &contact {
                    None => (wi, None),
                    Some(contact) => self.aimed(wi, contact, exit.point, &exit.frame, number)?,
                };
                let share = gone * crossing.exit_probabilities[1];
                let scattered = eval_exit(bsdf, crossing, wi, gone);
                (Side::Exit, wi, with_aim(scattered, share, &aim, wi))
            }
            Choice::Pass => {
                let pdf = gone * crossing.exit_probabilities[0];
                (Side::Straight, -passage.facet.incident, (bsdf.eval_straight(terms), pdf))
            }
            Choice::Lost => return None,
        };
        let ray = Ray { origin: exit.point, direction: exit.frame.to_world(wi) };
        (pdf > 0.0).then_some(Next { ray, side, wi, value, pdf, chance: looked, contact })
    }

    /// Adds light from one light source, scattered by `eval` (value and density), at a side that
    /// was come to with probability `chance`.
    #[inline(always)]
    fn add_light(
        &mut self,
        side: Side,
        point: DVec3,
        frame: &Frame,
        (choice, u): LightNumber,
        chance: f64,
        eval: impl Fn(DVec3) -> (Rgb, f64),
    ) {
        let Some(sample) = self.scene.lights.sample(point, choice, u) else { return };
        let LightSample { direction, distance, weight, pdf } = sample;
        let wi = frame.to_local(direction);
        let (value, scattered_pdf) = eval(wi);
        let dark =
            if self.limits.lobe_floor > 0.0 { scattered_pdf <= 0.0 } else { value == Rgb::ZERO };
        if dark || !self.scene.visible(point, direction, distance) {
            return;
        }
        let weight = weight * (pdf.map_or(1.0, |pdf| balance(pdf, scattered_pdf)) / chance);
        self.recorder.light(side, wi, weight);
        self.radiance += self.throughput * value * weight;
    }
}

/// Value and density of scattering at y into `wi`, `gone` being the probability of going on there.
#[inline]
fn eval_exit(bsdf: &PlyBsdf, crossing: &Crossing, wi: DVec3, gone: f64) -> (Rgb, f64) {
    crossing.passage.as_ref().map_or((Rgb::ZERO, 0.0), |(passage, terms)| {
        let pdf = gone * bsdf.pdf_exit(passage, crossing, wi);
        (bsdf.eval_exit(passage, terms, wi), pdf)
    })
}

/// Value and density of scattering into `wi`, where the body scatters the part `share` of the light
/// and half of that, or nothing, is aimed.
#[inline(always)]
fn with_aim((value, pdf): (Rgb, f64), share: f64, aim: &Option<Aim>, wi: DVec3) -> (Rgb, f64) {
    (value, aim.as_ref().map_or(pdf, |aim| 0.5 * (pdf + share * aim.pdf(wi))))
}

/// The path that goes on from x into the local direction `wi`, if that has any density.
#[inline(always)]
fn scattered_back(
    interaction: &Interaction,
    wi: DVec3,
    eval: impl Fn(DVec3) -> (Rgb, f64),
) -> Option<Next> {
    let (value, pdf) = eval(wi);
    let Interaction { point, frame, .. } = interaction;
    let ray = Ray { origin: *point, direction: frame.to_world(wi) };
    let contact = interaction.contact();
    let (side, chance) = (Side::Entry, 1.0);
    (pdf > 0.0).then_some(Next { ray, side, wi, value, pdf, chance, contact })
}

/// The balance heuristic (Veach 1997): the share of a strategy with density `own`.
#[inline]
fn balance(own: f64, other: f64) -> f64 {
    own / (own + other)
}

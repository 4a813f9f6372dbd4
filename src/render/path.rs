//! The path tracer: next-event estimation with multiple importance sampling at every x and y.

use glam::DVec3;

use super::aim::Target;
use super::light::LightSample;
use super::recorder::{Recorder, Side};
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
    /// the path goes through or that a lamp stands behind: less noise where a light with extent is
    /// behind, for one more shadow ray.
    pub both_sides: bool,
    /// How likely every lobe is at least that some parameters switch on, 0 to 1/4: paths that are to
    /// be evaluated for other parameters must not miss what is dark for those that they are drawn by.
    pub lobe_floor: f64,
}

/// The part of the directions that is aimed, where there is something to aim at. Whatever the aim
/// misses gains weight by what goes to it.
const AIMED: f64 = 0.25;

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
    /// The same without aims: what lights that are met are weighed by. Connections do not know
    /// whether there will be an aim.
    unaimed_pdf: f64,
    /// The probability of having come to this side at all.
    chance: f64,
    /// What is met at once, if the light does not go into the air.
    contact: Option<Box<Contact>>,
}

/// Random numbers that choose lights.
#[derive(Debug, Clone, Copy)]
struct LightNumbers {
    /// Chooses one of those without extent.
    lamp: f64,
    /// Chooses one of the others,
    extended: f64,
    /// and a point on it.
    point: [f64; 2],
}

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
            (ray, scattered_pdf, contact) = (next.ray, Some(next.unaimed_pdf), next.contact);
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
        let before = self.light_numbers();
        self.add_light_before(interaction, before, eval);
        let wi = square_to_cosine_hemisphere(self.sampler.next_2d());
        self.scattered_back(interaction, (Some(wi), 1.0), eval)
    }

    // Not inlined: it is long, and paths through diffuse cloth do without it.
    #[inline(never)]
    fn at_ply(&mut self, interaction: &Interaction, bsdf: &PlyBsdf) -> Option<Next> {
        let Interaction { material, wo, .. } = *interaction;
        let beyond = self.light_numbers();
        let lamp = self.lamp_beyond(interaction, beyond);
        let (passage, exit) = self.pass(interaction, bsdf, lamp).unzip();
        self.recorder.vertex(material, wo, passage.as_ref());
        let before = self.light_numbers();
        let crossing = bsdf.crossing(wo, passage, self.throughput, self.limits.lobe_floor);
        let eval = |wi| (bsdf.eval_entry(wo, &crossing, wi), bsdf.pdf_entry(wo, &crossing, wi));
        self.add_light_before(interaction, before, eval);
        // The probability of looking for light beyond the ply, and of going on there if so.
        let passed = crossing.entry_probabilities[2];
        // A lamp beyond is not seen from x: looking for it from y costs nothing more.
        let both_sides = self.limits.both_sides || lamp.is_some();
        let (looked, gone) = if both_sides { (1.0, passed) } else { (passed, 1.0) };
        if let (true, Some(exit)) = (both_sides, &exit) {
            self.add_light_beyond(bsdf, &crossing, exit, beyond, looked, gone);
        }
        let choice = bsdf.sample_entry(wo, &crossing, &mut self.sampler);
        if choice == Choice::Pass {
            let exit = exit?;
            if !both_sides {
                self.add_light_beyond(bsdf, &crossing, &exit, beyond, looked, gone);
            }
            return self.leave_ply(bsdf, &crossing, &exit, looked, gone);
        }
        self.scattered_back(interaction, (choice.direction(), 1.0 - passed), eval)
    }

    /// Refracts light into the ply, half of it aimed at a lamp beyond, and follows it to where it
    /// comes out.
    #[inline]
    fn pass(
        &mut self,
        interaction: &Interaction,
        bsdf: &PlyBsdf,
        lamp: Option<DVec3>,
    ) -> Option<(Passage, Exit)> {
        let (entry, facet) = (self.sampler.next_2d(), self.sampler.next_2d());
        let enters = interaction.is_in_air();
        let refracted = if enters {
            // As if y faced x.
            let facing = Frame::orthonormal(DVec3::Z, DVec3::X);
            let aim = lamp.and_then(|lamp| Aim::new(bsdf.exit_from_outside(), facing, lamp));
            bsdf.sample_refracted(interaction.wo, aim.as_ref(), self.limits.lobe_floor, entry)?
        } else {
            (-interaction.wo, 1.0)
        };
        let (Inside { incident, length }, exit) = self.scene.exit(interaction, refracted.0);
        let interfaces = [enters, exit.is_in_air()];
        Some((bsdf.sample_passage(interfaces, refracted, incident, length, facet), exit))
    }

    /// The direction, in the frame at x, to the lamp that these numbers choose, if it shines on the
    /// other side.
    #[inline]
    fn lamp_beyond(&self, interaction: &Interaction, numbers: LightNumbers) -> Option<DVec3> {
        let sample = self.scene.lights.sample_lamp(interaction.point, numbers.lamp)?;
        let lamp = interaction.frame.to_local(sample.direction);
        (lamp.z < 0.0).then_some(lamp)
    }

    /// What light that goes on from a point is aimed at: a lamp that it reaches only through plies.
    #[inline]
    fn target(
        &mut self,
        side: Side,
        point: DVec3,
        frame: &Frame,
        contact: Option<&Contact>,
    ) -> Option<Target> {
        let Scene { lights, .. } = self.scene;
        if !lights.have_lamps() || contact.is_none() && !self.scene.swatch.tile().has_ribbons() {
            return None;
        }
        let lamp = lights.sample_lamp(point, self.sampler.next_1d())?;
        if frame.normal().dot(lamp.direction) * side.sign() <= 0.0 {
            return None;
        }
        match contact {
            Some(contact) => self.scene.aim_through(contact, point, frame, lamp.direction),
            None => self.scene.aim_behind(point, frame, lamp),
        }
    }

    /// The path that goes on from `point` into a direction that the lobes there chose, unless they
    /// lose the light, or that is aimed. `share` is how likely either is, rather than that the light
    /// goes on otherwise.
    #[inline(always)]
    fn scattered(
        &mut self,
        (side, chance): (Side, f64),
        (point, frame): (DVec3, &Frame),
        contact: Option<Box<Contact>>,
        (lobes, share): (Option<DVec3>, f64),
        eval: impl Fn(DVec3) -> (Rgb, f64),
    ) -> Option<Next> {
        let target = self.target(side, point, frame, contact.as_deref());
        let wi = match &target {
            Some(target) if self.sampler.next_1d() < AIMED => {
                target.sample(self.sampler.next_2d())?
            }
            _ => lobes?,
        };
        let (value, unaimed_pdf) = eval(wi);
        let pdf = target.map_or(unaimed_pdf, |target| {
            (1.0 - AIMED) * unaimed_pdf + AIMED * share * target.pdf(wi)
        });
        let ray = Ray { origin: point, direction: frame.to_world(wi) };
        (unaimed_pdf > 0.0).then_some(Next {
            ray,
            side,
            wi,
            value,
            pdf,
            unaimed_pdf,
            chance,
            contact,
        })
    }

    /// The path that goes on from x.
    #[inline(always)]
    fn scattered_back(
        &mut self,
        interaction: &Interaction,
        lobes: (Option<DVec3>, f64),
        eval: impl Fn(DVec3) -> (Rgb, f64),
    ) -> Option<Next> {
        let place = (interaction.point, &interaction.frame);
        self.scattered((Side::Entry, 1.0), place, interaction.contact(), lobes, eval)
    }

    #[inline]
    fn light_numbers(&mut self) -> LightNumbers {
        let (lamp, extended) = (self.sampler.next_1d(), self.sampler.next_1d());
        LightNumbers { lamp, extended, point: self.sampler.next_2d() }
    }

    /// Adds light that reaches x through the air.
    #[inline]
    fn add_light_before(
        &mut self,
        interaction: &Interaction,
        numbers: LightNumbers,
        eval: impl Fn(DVec3) -> (Rgb, f64),
    ) {
        if interaction.is_in_air() {
            let Interaction { point, frame, .. } = interaction;
            self.add_light(Side::Entry, *point, frame, numbers, 1.0, eval);
        }
    }

    /// Adds light that reaches y from beyond the ply, if that is the air.
    #[inline]
    fn add_light_beyond(
        &mut self,
        bsdf: &PlyBsdf,
        crossing: &Crossing,
        exit: &Exit,
        numbers: LightNumbers,
        looked: f64,
        gone: f64,
    ) {
        if exit.is_in_air() {
            let eval = |wi| eval_exit(bsdf, crossing, wi, gone);
            self.add_light(Side::Exit, exit.point, &exit.frame, numbers, looked, eval);
        }
    }

    /// Scatters light that went through the ply, at y.
    #[inline]
    fn leave_ply(
        &mut self,
        bsdf: &PlyBsdf,
        crossing: &Crossing,
        exit: &Exit,
        chance: f64,
        gone: f64,
    ) -> Option<Next> {
        let (passage, terms) = crossing.passage.as_ref()?;
        let contact = exit.contact();
        let [straight, body] = crossing.exit_probabilities;
        let choice = bsdf.sample_exit(passage, crossing, &mut self.sampler);
        if choice == Choice::Pass {
            let (side, wi, pdf) = (Side::Straight, -passage.facet.incident, gone * straight);
            let ray = Ray { origin: exit.point, direction: exit.frame.to_world(wi) };
            let value = bsdf.eval_straight(terms);
            return Some(Next { ray, side, wi, value, pdf, unaimed_pdf: pdf, chance, contact });
        }
        let share = gone * if contact.is_some() { body } else { 1.0 };
        let place = (exit.point, &exit.frame);
        let eval = |wi| eval_exit(bsdf, crossing, wi, gone);
        self.scattered((Side::Exit, chance), place, contact, (choice.direction(), share), eval)
    }

    /// Adds light from one lamp and one other light, scattered by `eval` (value and density), at a
    /// side that was come to with probability `chance`.
    #[inline(always)]
    fn add_light(
        &mut self,
        side: Side,
        point: DVec3,
        frame: &Frame,
        LightNumbers { lamp, extended, point: u }: LightNumbers,
        chance: f64,
        eval: impl Fn(DVec3) -> (Rgb, f64),
    ) {
        let lights = &self.scene.lights;
        let lamp = lights.sample_lamp(point, lamp);
        let extended = lights.sample_extended(point, extended, u);
        for sample in [lamp, extended].into_iter().flatten() {
            let LightSample { direction, distance, weight, pdf } = sample;
            let wi = frame.to_local(direction);
            let (value, scattered_pdf) = eval(wi);
            let dark = if self.limits.lobe_floor > 0.0 {
                scattered_pdf <= 0.0
            } else {
                value == Rgb::ZERO
            };
            if dark || !self.scene.visible(point, direction, distance) {
                continue;
            }
            let weight = weight * (pdf.map_or(1.0, |pdf| balance(pdf, scattered_pdf)) / chance);
            self.recorder.light(side, wi, weight);
            self.radiance += self.throughput * value * weight;
        }
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

/// The balance heuristic (Veach 1997): the share of a strategy with density `own`.
#[inline]
fn balance(own: f64, other: f64) -> f64 {
    own / (own + other)
}

//! What a recorded microfacet lets through when the refractive index changes.
//!
//! From inside a ply (index n) light meets a microfacet at the cosine c and leaves it at the cosine
//! t, where t^2 = 1 - n^2 (1 - c^2); beyond the critical cosine, t = 0, everything is reflected. What
//! passes grows as t, and with the microfacet held its derivative by n grows as 1/t = 1/sqrt(c -
//! critical): an estimator of infinite variance. So part of what passes is carried by a microfacet
//! that moves with n along the meridian about the incident direction such that t stays. On a meridian
//!
//! ```text
//! q = (c^2 - k^2) / (1 - k^2),    k = max(critical cosine, cosine where the meridian ends),
//! ```
//!
//! is kept: it runs from 0 to 1 for every n, so what is moved covers all microfacets that let light
//! through, once each, and it is t^2 unless the meridian ends at the horizon before it is critical.
//!
//! A moved microfacet changes its probability, which costs noise where the distribution is narrow. So
//! a window h(q) around the critical cosine is moved and the rest, whose derivative is bounded, is
//! held:
//!
//! ```text
//! E[passed] = E[w(m) (1 - h(q)) passed(m)] + E[w(m') |dm'/dm| h(q) passed(m')],
//! ```
//!
//! with w the density of visible normals over that of the recorded choice. It is exact for every n,
//! and at the recorded parameters the two are the parts of one, so the value is the plain one.

use glam::DVec3;

use super::dielectric::RoughDielectric;
use super::fresnel::fresnel;
use super::ggx::Ggx;
use crate::math::dual::{Real, Vector, constant};

/// A microfacet at y drawn from the visible normals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnFacet {
    /// The direction that light comes from, inside the ply (unit, z > 0).
    pub incident: DVec3,
    /// The normal of the microfacet (unit, z >= 0, visible).
    pub normal: DVec3,
    /// The density with which it was chosen.
    pub pdf: f64,
    /// The refractive index of the ply then, above 1.
    pub eta: f64,
}

/// The width in q of the window that is moved, over the roughness; measured to be quiet at any
/// roughness. The means do not depend on it.
const WINDOW: f64 = 3.0;

impl DrawnFacet {
    /// How likely this one is to be seen, over how likely it was chosen.
    #[inline]
    pub fn visible<T: Real>(&self, exit: &RoughDielectric<T>) -> T {
        exit.ggx.visible_normal_pdf(&constant(self.incident), &constant(self.normal)) / self.pdf
    }

    /// The light that passes through the microfacets at y, as an expectation over the choice of this
    /// one: the visible part times 1 - F. `exit` is the interface seen from inside.
    #[inline]
    pub fn passed<T: Real>(&self, exit: &RoughDielectric<T>) -> T {
        let eta = exit.eta.recip();
        let meridian = Meridian::new(self.incident, self.normal);
        let plain = T::from(1.0) - fresnel(T::from(meridian.cosine), exit.eta);
        let weight = |normal: &Vector<T>| {
            exit.ggx.visible_normal_pdf(&constant(self.incident), normal) / self.pdf
        };
        let held = self.visible(exit) * plain;
        if meridian.ends_before(self.eta) && meridian.ends_before(eta.re()) {
            return held;
        }
        let (before, now) = (meridian.start(self.eta), meridian.start(eta));
        let width = width(&exit.ggx);
        let mut passed = T::from(0.0);
        if plain.re() > 0.0 {
            passed += held * (T::from(1.0) - window(meridian.place(now), width));
        }
        let place = meridian.place(before);
        if place > 0.0 && place < width.re() {
            let moved = meridian.at(place, now, eta);
            // dc'/dc of c'^2 = k'^2 + q (1 - k'^2).
            let stretch = (T::from(1.0) - now) / (1.0 - before);
            let jacobian = stretch * meridian.cosine / moved.cosine;
            let share = window(T::from(place), width) * jacobian;
            passed += weight(&moved.normal) * share * moved.passed;
        }
        passed
    }
}

/// The width of the window in q.
#[inline]
fn width<T: Real>(ggx: &Ggx<T>) -> T {
    let width = (ggx.along * ggx.across).sqrt() * WINDOW;
    if width.re() < 1.0 { width } else { T::from(1.0) }
}

/// The microfacets c i + sqrt(1 - c^2) e around an incident direction i, e being the unit vector
/// perpendicular to i towards one of them.
struct Meridian {
    incident: DVec3,
    towards: DVec3,
    /// c of that one.
    cosine: f64,
    /// The square of the cosine where the meridian meets the horizon, or 0.
    end2: f64,
}

/// A microfacet on a meridian.
struct Moved<T> {
    normal: Vector<T>,
    cosine: T,
    passed: T,
}

impl Meridian {
    #[inline]
    fn new(incident: DVec3, normal: DVec3) -> Self {
        let cosine = incident.dot(normal);
        let towards = (normal - cosine * incident).normalize_or_zero();
        let below = (-towards.z).max(0.0);
        let end2 = below * below / (below * below + incident.z * incident.z);
        Self { incident, towards, cosine, end2 }
    }

    /// Whether the meridian meets the horizon before total reflection sets in.
    #[inline]
    fn ends_before(&self, eta: f64) -> bool {
        self.end2 >= 1.0 - 1.0 / (eta * eta)
    }

    /// k^2, the least square of a cosine at which light passes.
    #[inline]
    fn start<T: Real>(&self, eta: T) -> T {
        if self.ends_before(eta.re()) {
            T::from(self.end2)
        } else {
            T::from(1.0) - (eta * eta).recip()
        }
    }

    /// q of the recorded microfacet, given k^2.
    #[inline]
    fn place<T: Real>(&self, start: T) -> T {
        (T::from(self.cosine * self.cosine) - start) / (T::from(1.0) - start)
    }

    /// The microfacet at q = `place` > 0 for k^2 = `start`.
    #[inline]
    fn at<T: Real>(&self, place: f64, start: T, eta: T) -> Moved<T> {
        let (cosine2, sine2) =
            (start * (1.0 - place) + place, (T::from(1.0) - start) * (1.0 - place));
        let (cosine, sine) = (cosine2.sqrt(), sine2.sqrt());
        let component = |axis| cosine * self.incident[axis] + sine * self.towards[axis];
        // Where all is measured from the critical cosine, t does not depend on eta.
        let refracted = if self.ends_before(eta.re()) {
            (T::from(1.0) - eta * eta * sine2).sqrt()
        } else {
            T::from(place.sqrt())
        };
        Moved {
            normal: [component(0), component(1), component(2)],
            cosine,
            passed: transmitted(cosine, refracted, eta),
        }
    }
}

/// 1 - F of light that meets a surface from inside at `cosine` and leaves it at `refracted`.
#[inline]
fn transmitted<T: Real>(cosine: T, refracted: T, eta: T) -> T {
    let perpendicular = eta * cosine + refracted;
    let parallel = cosine + eta * refracted;
    let sum = (perpendicular * perpendicular).recip() + (parallel * parallel).recip();
    eta * cosine * refracted * sum * 2.0
}

/// One at `place` = 0, falling smoothly to zero at `width`.
#[inline]
fn window<T: Real>(place: T, width: T) -> T {
    let x = place / width;
    if x.re() >= 1.0 {
        return T::from(0.0);
    }
    T::from(1.0) - x * x * (x * -2.0 + 3.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use num_dual::DualNum;

    use super::*;
    use crate::math::dual::{Dual6, gradient, variable};
    use crate::math::frame::Frame;
    use crate::math::rng::Sampler;

    /// Index, roughness along and across, and z of the incident direction: critical angles within,
    /// beside and across the lobe and the horizon.
    const CASES: [(f64, [f64; 2], f64); 8] = [
        (1.5, [0.05, 0.05], 0.75),
        (1.5, [0.05, 0.05], 0.9),
        (1.5, [0.3, 0.3], 0.75),
        (1.5, [0.4, 0.5], 0.9),
        (1.5, [0.05, 0.5], 0.8),
        (1.3, [1.0, 1.0], 0.4),
        (2.0, [0.4, 0.5], 0.95),
        (1.1, [0.4, 0.5], 0.6),
    ];

    fn direction(z: f64, azimuth: f64) -> DVec3 {
        let sine = (1.0 - z * z).sqrt();
        DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), z)
    }

    fn exit(eta: f64, [along, across]: [f64; 2]) -> RoughDielectric {
        RoughDielectric { eta: eta.recip(), ggx: Ggx { along, across } }
    }

    /// The same, with derivatives by the index and the roughness.
    fn dual_exit(eta: f64, [along, across]: [f64; 2]) -> RoughDielectric<Dual6> {
        let ggx = Ggx { along: variable(along, 1), across: variable(across, 2) };
        RoughDielectric { eta: variable(eta, 0).recip(), ggx }
    }

    fn draw(eta: f64, ggx: &Ggx, incident: DVec3, u: [f64; 2]) -> DrawnFacet {
        let normal = ggx.sample_visible_normal(incident, u);
        let pdf = ggx.visible_normal_pdf(&constant(incident), &constant(normal));
        DrawnFacet { incident, normal, pdf, eta }
    }

    fn cosine(facet: &DrawnFacet) -> f64 {
        facet.incident.dot(facet.normal)
    }

    fn uniform(u: f64, [least, most]: [f64; 2]) -> f64 {
        least + u * (most - least)
    }

    /// A microfacet, incident direction, index and roughness at random.
    fn random(sampler: &mut Sampler) -> (DrawnFacet, [f64; 2]) {
        let incident = direction(uniform(sampler.next_1d(), [0.05, 1.0]), TAU * sampler.next_1d());
        let roughness = sampler.next_2d().map(|u| uniform(u, [0.05, 1.0]));
        let eta = uniform(sampler.next_1d(), [1.05, 2.0]);
        let ggx = exit(eta, roughness).ggx;
        (draw(eta, &ggx, incident, sampler.next_2d()), roughness)
    }

    /// The integral of `f` over the normals visible from `incident`: midpoints along meridians, dense
    /// around the critical angles of `etas`.
    fn integral(incident: DVec3, etas: [f64; 2], f: impl Fn(DVec3) -> f64) -> f64 {
        const AZIMUTHS: usize = 300;
        const STEPS: usize = 240;
        let frame = Frame::new(incident, DVec3::X);
        let mut sum = 0.0;
        for azimuth in 0..AZIMUTHS {
            let angle = TAU * (azimuth as f64 + 0.5) / AZIMUTHS as f64;
            let towards = frame.to_world(DVec3::new(angle.cos(), angle.sin(), 0.0));
            let below = (-towards.z).max(0.0);
            let end = below / below.hypot(incident.z);
            let mut ends = [end, 1.0, 1.0, 1.0];
            for (end_here, eta) in ends[1..3].iter_mut().zip(etas) {
                *end_here = end.max((1.0 - 1.0 / (eta * eta)).sqrt());
            }
            ends.sort_by(f64::total_cmp);
            for pair in ends.windows(2) {
                let (least, length) = (pair[0], pair[1] - pair[0]);
                for step in 0..STEPS {
                    let u = (step as f64 + 0.5) / STEPS as f64;
                    let c = least + length * u * u * (3.0 - 2.0 * u);
                    let normal = c * incident + (1.0 - c * c).max(0.0).sqrt() * towards;
                    sum += f(normal) * length * 6.0 * u * (1.0 - u);
                }
            }
        }
        sum * TAU / (AZIMUTHS * STEPS) as f64
    }

    /// The expectation of what passes, by quadrature.
    fn expected(incident: DVec3, exit: &RoughDielectric) -> f64 {
        let eta = exit.eta.recip();
        integral(incident, [eta; 2], |normal| {
            let pdf = exit.ggx.visible_normal_pdf(&constant(incident), &constant(normal));
            pdf * (1.0 - fresnel(incident.dot(normal), exit.eta))
        })
    }

    #[test]
    fn at_the_recorded_parameters_the_value_is_the_plain_one() {
        let mut worst = 0.0f64;
        for i in 0..100_000 {
            let (facet, roughness) = random(&mut Sampler::new(1, 0, i));
            let plain = 1.0 - fresnel(cosine(&facet), facet.eta.recip());
            let passed = facet.passed(&exit(facet.eta, roughness));
            worst = worst.max((passed - plain).abs());
        }
        assert!(worst < 1e-9, "{worst}");
    }

    #[test]
    fn straight_and_grazing_microfacets_have_finite_derivatives() {
        let grazing = direction(1e-9, 0.3);
        for (incident, normal) in [
            (DVec3::Z, DVec3::Z),
            (DVec3::Z, direction(1e-12, 0.1)),
            (grazing, DVec3::Z),
            (grazing, direction(1e-12, 0.3)),
        ] {
            for (eta, now) in [(1.5, 1.5), (1.05, 2.0), (2.0, 1.05), (1.5, 1.51)] {
                let facet = DrawnFacet { incident, normal, pdf: 1.0, eta };
                let passed = facet.passed(&dual_exit(now, [1.0, 1.0]));
                assert!(passed.re.is_finite(), "{incident} {normal} {eta} {now}");
                assert!(gradient(passed).iter().all(|d| d.is_finite()), "{incident} {normal}");
            }
        }
    }

    /// Quadrature over the recorded choice: all the light that passes at another index and another
    /// roughness, none of it twice.
    #[test]
    fn the_mean_is_exact_at_other_parameters() {
        let recorded = [0.4, 0.6];
        for z in [0.2, 0.5, 0.8, 0.98] {
            let incident = direction(z, 0.7);
            for (before, now) in
                [(1.05, 2.0), (2.0, 1.05), (1.5, 1.4), (1.4, 1.5), (1.1, 1.2), (1.6, 1.15)]
            {
                for roughness in [recorded, [0.5, 0.5]] {
                    let (then, exit) = (exit(before, recorded), exit(now, roughness));
                    let mean = integral(incident, [before, now], |normal| {
                        let pdf =
                            then.ggx.visible_normal_pdf(&constant(incident), &constant(normal));
                        pdf * DrawnFacet { incident, normal, pdf, eta: before }.passed(&exit)
                    });
                    let error = mean - expected(incident, &exit);
                    assert!(error.abs() < 2e-5, "z {z}, {before} to {now}: {error}");
                }
            }
        }
    }

    /// The index at which a meridian's end becomes critical: nothing jumps there.
    #[test]
    fn what_passes_is_continuous_where_a_meridian_ends_at_its_critical_angle() {
        let mut seen = 0;
        for i in 0..20_000 {
            let (facet, roughness) = random(&mut Sampler::new(3, 0, i));
            let meridian = Meridian::new(facet.incident, facet.normal);
            let critical = (1.0 - meridian.end2).sqrt().recip();
            if (1.02..2.5).contains(&critical) {
                let at = |eta: f64| facet.passed(&exit(eta, roughness));
                let (below, above) = (at(critical * (1.0 - 1e-9)), at(critical * (1.0 + 1e-9)));
                assert!((below - above).abs() < 1e-4 * (1.0 + below), "{facet:?}: {below} {above}");
                seen += 1;
            }
        }
        assert!(seen > 1_000, "{seen}");
    }

    /// Against central differences, for microfacets at random, the most of them drawn close to the
    /// critical angle.
    #[test]
    fn derivatives_agree_with_differences() {
        let (mut seen, mut critical) = (0, 0);
        for i in 0..60_000 {
            let mut sampler = Sampler::new(2, 0, i);
            let (mut facet, roughness) = random(&mut sampler);
            if i % 3 > 0 {
                let sine2 = 1.0 - cosine(&facet).powi(2);
                let beside = 10f64.powf(uniform(sampler.next_1d(), [-8.0, -1.0]));
                facet.eta = ((1.0 - beside) / sine2).sqrt();
            }
            // A meridian that ends where it is critical has a kink there.
            let step = 1e-6;
            let meridian = Meridian::new(facet.incident, facet.normal);
            let kink = (1.0 - facet.eta.powi(-2) - meridian.end2).abs() < 10.0 * step;
            if kink || !(1.02..2.5).contains(&facet.eta) {
                continue;
            }
            let at = |eta: f64| facet.passed(&exit(eta, roughness));
            let now = facet.eta
                + if i % 2 == 0 { 0.0 } else { uniform(sampler.next_1d(), [-0.01, 0.01]) };
            let derivative = gradient(facet.passed(&dual_exit(now, roughness)))[0];
            let difference = (at(now + step) - at(now - step)) / (2.0 * step);
            let error = (derivative - difference).abs() / (1.0 + derivative.abs());
            assert!(error < 1e-3, "{facet:?} {roughness:?} {now}: {derivative} {difference}");
            seen += 1;
            let refracted2 = 1.0 - facet.eta.powi(2) * (1.0 - cosine(&facet).powi(2));
            critical += i32::from((0.0..1e-4).contains(&refracted2));
        }
        assert!(seen > 30_000 && critical > 5_000, "{seen} {critical}");
    }

    /// The mean and the variance of derivatives by the index over `samples` microfacets, and the
    /// largest share of one in the sum of squares; of [`DrawnFacet::passed`] at `now`, and of 1 - F
    /// with the microfacet held.
    fn statistics(case: usize, now: f64, seed: u64, samples: u64) -> [[f64; 3]; 2] {
        let (eta, roughness, z) = CASES[case];
        let (incident, ggx) = (direction(z, 0.9), exit(eta, roughness).ggx);
        let exit = dual_exit(now, roughness);
        let mut sums = [[0.0, 0.0, 0.0f64]; 2];
        for i in 0..samples {
            let u = Sampler::new(seed, case as u64, i).next_2d();
            let facet = draw(eta, &ggx, incident, u);
            let held = -fresnel(Dual6::from(cosine(&facet)), exit.eta);
            for (sum, number) in sums.iter_mut().zip([facet.passed(&exit), held]) {
                let [derivative, ..] = gradient(number);
                sum[0] += derivative;
                sum[1] += derivative * derivative;
                sum[2] = sum[2].max(derivative * derivative);
            }
        }
        let n = samples as f64;
        sums.map(|[sum, square, most]| [sum / n, square / n - (sum / n).powi(2), most / square])
    }

    #[test]
    fn the_mean_derivative_is_that_of_the_mean() {
        let samples = 200_000;
        for (case, (eta, roughness, z)) in CASES.into_iter().enumerate() {
            for now in [eta, 1.02 * eta] {
                let at = |now| expected(direction(z, 0.9), &exit(now, roughness));
                let step = 2e-3;
                let [far, near] = [2.0, 1.0]
                    .map(|k| (at(now + k * step) - at(now - k * step)) / (2.0 * k * step));
                let truth = (4.0 * near - far) / 3.0;
                let [[mean, variance, _], _] = statistics(case, now, 5, samples);
                let deviation = (mean - truth) / (variance / samples as f64).sqrt();
                assert!(deviation.abs() < 3.5, "case {case} at {now}: {mean} {truth} {deviation}");
            }
        }
    }

    /// With a finite variance no sample of many has a share to speak of in the sum of squares; with
    /// the microfacet held, a few are most of it.
    #[test]
    fn no_single_derivative_outweighs_the_others() {
        let mut held_most = 0.0;
        for (case, (eta, ..)) in CASES.into_iter().enumerate() {
            for now in [eta, 1.01 * eta] {
                let [[.., most], [.., held]] = statistics(case, now, 6, 100_000);
                assert!(most < 0.02, "case {case} at {now}: {most}");
                held_most += held / (2 * CASES.len()) as f64;
            }
        }
        assert!(held_most > 0.1, "{held_most}");
    }
}

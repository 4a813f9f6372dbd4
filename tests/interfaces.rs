//! Rough interfaces: every lobe against its density, and energy and reciprocity.

mod common;

use common::chi2::{check, sphere_integral};
use common::lobes::{TESTS, agree, albedos, ggx, mean, random, views, visible};
use common::rays::direction;
use glam::DVec3;
use plycloth::math::dual::constant;
use plycloth::sampling::warp::{square_to_cosine_hemisphere, square_to_cosine_hemisphere_pdf};
use plycloth::scatter::dielectric::RoughDielectric;
use plycloth::scatter::fresnel::fresnel;

const WIDTHS: [[f64; 2]; 3] = [[0.2, 0.3], [0.15, 0.6], [1.0, 1.0]];

/// Interfaces from outside (eta > 1) and from inside.
fn interfaces() -> impl Iterator<Item = RoughDielectric> {
    let etas = [1.5, 1.0 / 1.5];
    WIDTHS.into_iter().flat_map(move |w| etas.map(|eta| RoughDielectric { eta, ggx: ggx(w) }))
}

#[test]
fn microfacets_cover_the_plane_once() {
    for widths in WIDTHS {
        let projected = |h: DVec3| h.z.max(0.0) * ggx(widths).density(&constant(h));
        let area = sphere_integral(projected);
        assert!((area - 1.0).abs() < 2e-3, "{widths:?} {area}");
    }
}

#[test]
fn visible_microfacets_cover_every_view_once() {
    for widths in WIDTHS {
        for w in views() {
            let seen = sphere_integral(|h| visible(&ggx(widths), w, h));
            assert!((seen - 1.0).abs() < 2e-3, "{widths:?} {w} {seen}");
        }
    }
}

#[test]
fn visible_normals_have_their_density() {
    for widths in WIDTHS {
        for w in views() {
            let sample = |i| Some(ggx(widths).sample_visible_normal(w, random(i).next_2d()));
            check(&format!("{widths:?} {w}"), TESTS, |h| visible(&ggx(widths), w, h), sample);
        }
    }
}

#[test]
fn mirrored_and_refracted_directions_have_their_densities() {
    for interface in interfaces() {
        for wo in views() {
            let name = format!("{interface:?} {wo}");
            let pdf = |wi| interface.reflection_pdf(&constant(wo), &constant(wi));
            let sample = |i| interface.sample_reflection(wo, random(i).next_2d());
            check(&format!("reflection {name}"), TESTS, pdf, sample);
            let pdf = |wi| interface.refraction_pdf(&constant(wo), &constant(wi));
            let sample = |i| interface.sample_refraction(wo, random(i).next_2d());
            check(&format!("refraction {name}"), TESTS, pdf, sample);
        }
    }
}

#[test]
fn cosine_directions_have_their_density() {
    let sample = |i| Some(square_to_cosine_hemisphere(random(i).next_2d()));
    check("cosine", TESTS, square_to_cosine_hemisphere_pdf, sample);
}

/// What sampled directions are worth on average is the integral of what they are worth.
#[test]
fn weights_average_to_integrals() {
    let n = 20_000;
    for interface in interfaces() {
        for wo in views() {
            let out = constant(wo);
            let reflected = mean((0..n).map(|i| {
                let wi = interface.sample_reflection(wo, random(i).next_2d());
                wi.map_or(0.0, |wi| {
                    let wi = constant(wi);
                    interface.reflection(&out, &wi) / interface.reflection_pdf(&out, &wi)
                })
            }));
            let refracted = mean((0..n).map(|i| {
                let wi = interface.sample_refraction(wo, random(i).next_2d());
                wi.map_or(0.0, |wi| {
                    let wi = constant(wi);
                    interface.refraction(&out, &wi) / interface.refraction_pdf(&out, &wi)
                })
            }));
            let [reflection, refraction] = albedos(&interface, wo);
            agree(reflected, reflection, &format!("reflection {interface:?} {wo}"));
            agree(refracted, refraction, &format!("refraction {interface:?} {wo}"));
        }
    }
}

/// Energy: what is not reflected or refracted is what other microfacets block, found from the
/// visible normals instead of the directions.
#[test]
fn reflection_refraction_and_blocked_light_add_up_to_one() {
    for interface in interfaces() {
        for wo in views() {
            let blocked =
                sphere_integral(|h| visible(&interface.ggx, wo, h) * blocked(&interface, wo, h));
            let [reflection, refraction] = albedos(&interface, wo);
            let sum = reflection + refraction + blocked;
            assert!((sum - 1.0).abs() < 4e-3, "{interface:?} {wo}: {sum}");
        }
    }
}

/// The part of the light that a microfacet scatters into others.
fn blocked(interface: &RoughDielectric, wo: DVec3, h: DVec3) -> f64 {
    let cosine = wo.dot(h);
    if cosine <= 0.0 {
        return 0.0;
    }
    let shadow = |wi: DVec3, side: f64| {
        let out = wi.z * side > 0.0;
        if out { 1.0 - interface.ggx.masking(&constant(wi)) } else { 1.0 }
    };
    let reflected = fresnel(cosine, interface.eta);
    let mirrored = reflected * shadow(2.0 * cosine * h - wo, 1.0);
    let cos2_t = 1.0 - (1.0 - cosine * cosine) / (interface.eta * interface.eta);
    if reflected >= 1.0 || cos2_t <= 0.0 {
        return mirrored;
    }
    let refracted = (cosine / interface.eta - cos2_t.sqrt()) * h - wo / interface.eta;
    mirrored + (1.0 - reflected) * shadow(refracted, -1.0)
}

#[test]
fn both_directions_of_light_are_worth_the_same() {
    for interface in interfaces() {
        let reverse = RoughDielectric { eta: interface.eta.recip(), ..interface };
        let mut refracted = 0;
        for number in 0..2_000 {
            let mut sampler = random(number);
            let [a, b] = [(); 2].map(|()| direction(&mut sampler)).map(|w| w.with_z(w.z.abs()));
            let [there, back] = [[a, b], [b, a]]
                .map(|[o, i]| interface.reflection(&constant(o), &constant(i)) * o.z);
            assert!((there - back).abs() <= 1e-12 * there, "{there} {back}");
            // Seen from below, up is down; refraction squeezes light by eta squared.
            let there = interface.refraction(&constant(a), &constant(-b)) * a.z;
            let flipped = |w: DVec3| constant::<f64>(w.with_z(-w.z));
            let back = reverse.refraction(&flipped(-b), &flipped(a)) * b.z;
            let back = back * interface.eta * interface.eta;
            assert!((there - back).abs() <= 1e-8 * there, "{there} {back}");
            refracted += usize::from(there > 0.0);
        }
        assert!(refracted > 100, "{refracted}");
    }
}

//! Every lobe against its density, and the energy that lobes pass on against each other.

mod common;

use common::chi2::{check, sphere_integral};
use common::parameters;
use common::rays::direction;
use glam::DVec3;
use plycloth::math::color::Rgb;
use plycloth::math::dual::constant;
use plycloth::math::frame::Frame;
use plycloth::math::rng::Sampler;
use plycloth::sampling::warp::{square_to_cosine_hemisphere, square_to_cosine_hemisphere_pdf};
use plycloth::scatter::aim::Aim;
use plycloth::scatter::dielectric::RoughDielectric;
use plycloth::scatter::fresnel::fresnel;
use plycloth::scatter::ggx::Ggx;
use plycloth::scatter::halo::Halo;
use plycloth::scatter::passage::Passage;
use plycloth::scatter::ply::{Choice, Crossing, PlyBsdf, PlyParameters};
use plycloth::scatter::ribbon::Ribbon;

/// Chi-square tests in this file, for the common significance.
const TESTS: usize = 160;

const WIDTHS: [[f64; 2]; 3] = [[0.2, 0.3], [0.15, 0.6], [1.0, 1.0]];

fn ggx([along, across]: [f64; 2]) -> Ggx {
    Ggx { along, across }
}

/// From the normal almost down to the horizon, at several azimuths.
fn views() -> [DVec3; 4] {
    [(0.0, 0.0), (0.6, 1.0), (1.1, 2.5), (1.45, -0.7)].map(|(theta, phi): (f64, f64)| {
        DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    })
}

/// Interfaces from outside (eta > 1) and from inside.
fn interfaces() -> impl Iterator<Item = RoughDielectric> {
    let etas = [1.5, 1.0 / 1.5];
    WIDTHS.into_iter().flat_map(move |w| etas.map(|eta| RoughDielectric { eta, ggx: ggx(w) }))
}

fn random(number: usize) -> Sampler {
    Sampler::new(3, number as u64, 0)
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

/// The density of visible normals, over the whole sphere.
fn visible(ggx: &Ggx, w: DVec3, h: DVec3) -> f64 {
    let facing = h.z > 0.0 && w.dot(h) > 0.0;
    if facing { ggx.visible_normal_pdf(&constant(w), &constant(h)) } else { 0.0 }
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

/// Mean and standard error.
fn mean(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let values: Vec<_> = values.collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    [mean, (variance / n).sqrt()]
}

fn agree([mean, error]: [f64; 2], expected: f64, name: &str) {
    let off = (mean - expected).abs();
    assert!(off < 4.5 * error + 1e-3 * expected, "{name}: {mean} +- {error}, not {expected}");
}

/// What is reflected and refracted of light that is seen from `wo`.
fn albedos(interface: &RoughDielectric, wo: DVec3) -> [f64; 2] {
    let wo = constant(wo);
    [
        sphere_integral(|wi| interface.reflection(&wo, &constant(wi))),
        sphere_integral(|wi| interface.refraction(&wo, &constant(wi))),
    ]
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

/// Plies that show each lobe: mostly mirror, mostly body, and clear.
fn plies() -> [PlyBsdf; 3] {
    let clear = PlyParameters { extinction: 0.0, ..parameters() };
    let dense = PlyParameters { extinction: 20.0, roughness: ggx([0.5, 0.15]), ..parameters() };
    [parameters(), clear, dense].map(|p| PlyBsdf::new(p).unwrap())
}

/// A passage that comes out a little askew.
fn passage(bsdf: &PlyBsdf, wo: DVec3) -> (Passage, Crossing) {
    passage_with(bsdf, wo, [true; 2], 0.0)
}

/// The same, perhaps from or into a ply that touches, and with a floor under the lobes.
fn passage_with(
    bsdf: &PlyBsdf,
    wo: DVec3,
    interfaces: [bool; 2],
    floor: f64,
) -> (Passage, Crossing) {
    let refracted = bsdf.sample_refracted(wo, None, 0.0, [0.3, 0.6]).unwrap();
    let incident = (DVec3::new(0.2, -0.4, 0.0) - refracted.0).normalize();
    let passage = bsdf.sample_passage(interfaces, refracted, incident, 0.4, [0.7, 0.2]);
    // A path that is red already.
    (passage, bsdf.crossing(wo, Some(passage), Rgb::new(0.9, 0.2, 0.1), floor))
}

/// What leads to a lamp beyond, through a surface that does not face x.
fn aim(bsdf: &PlyBsdf) -> Aim {
    let lamp = DVec3::new(0.3, -0.5, -1.0).normalize();
    let normal = DVec3::new(0.2, 0.3, 1.0).normalize();
    Aim::new(bsdf.exit_from_outside(), Frame::new(normal, DVec3::Y), lamp).unwrap()
}

#[test]
fn aims_have_their_density_and_their_middle() {
    for bsdf in plies() {
        let aim = aim(&bsdf);
        let name = format!("aim {:?}", bsdf.parameters());
        check(&name, TESTS, |direction| aim.pdf(direction), |i| aim.sample(random(i).next_2d()));
        let view = Frame::new(DVec3::new(0.6, 0.0, 0.8), DVec3::Y);
        let (seen, middle) = (aim.clone().seen_from(&view), aim.middle());
        let local = view.to_local(middle);
        assert!((seen.middle() - local).length() < 1e-12);
        assert!((seen.pdf(local) / aim.pdf(middle) - 1.0).abs() < 1e-9);
        // Snell's law at the smooth interface.
        let (normal, lamp) = (DVec3::new(0.2, 0.3, 1.0), DVec3::new(0.3, -0.5, -1.0));
        let sines = [middle, lamp].map(|d| d.normalize().cross(normal.normalize()));
        assert!((bsdf.parameters().eta * sines[0] - sines[1]).length() < 1e-12);
    }
}

#[test]
fn halos_have_their_density() {
    let frame = Frame::new(DVec3::new(0.2, 0.3, 1.0).normalize(), DVec3::Y);
    for bsdf in plies() {
        for lamp in views() {
            let halo = Halo::new(&bsdf, frame, lamp);
            let name = format!("halo {:?} {lamp}", bsdf.parameters());
            let sample = |i| halo.sample(random(i).next_2d());
            check(&name, TESTS, |direction| halo.pdf(direction), sample);
        }
    }
}

/// Light goes through a ribbon to a lamp from where its halo says: directions chosen by it are worth
/// about the same, those chosen by cosine hardly anything or very much.
#[test]
fn halos_are_where_ribbons_pass_light_from() {
    let roughness = ggx([0.1, 0.2]);
    let base =
        PlyParameters { roughness, exit_roughness: roughness, extinction: 0.0, ..parameters() };
    let ribbon = |base| Ribbon::new(PlyBsdf::new(base).unwrap(), 0.1);
    let clear = ribbon(PlyParameters { transmitted_color: Rgb::ZERO, ..base });
    for lamp in &views()[..3] {
        let halo = Halo::new(&PlyBsdf::new(base).unwrap(), Frame::new(DVec3::Z, DVec3::X), *lamp);
        let spread = |sample: &dyn Fn([f64; 2]) -> Option<(DVec3, f64)>| {
            let worth = |i: usize| {
                let mut sampler = random(i);
                let Some((from, pdf)) = sample(sampler.next_2d()) else { return 0.0 };
                clear.eval(-from, *lamp, 64, &mut sampler).0.x / pdf
            };
            let values: Vec<f64> = (0..4000).map(worth).collect();
            let count = values.len() as f64;
            let [average, error] = mean(values.into_iter());
            error * count.sqrt() / average
        };
        let by_halo = spread(&|u| halo.sample(u).map(|w| (w, halo.pdf(w))));
        let by_cosine = spread(&|u| {
            let w = square_to_cosine_hemisphere(u);
            Some((w, square_to_cosine_hemisphere_pdf(w)))
        });
        assert!(by_halo < 1.0 && by_cosine > 3.0, "{lamp}: {by_halo} {by_cosine}");
    }
}

#[test]
fn refracted_directions_have_their_density_with_a_lamp_beyond() {
    for bsdf in plies() {
        for wo in views() {
            for (aim, floor) in [(Some(aim(&bsdf)), 0.0), (Some(aim(&bsdf)), 0.1), (None, 0.1)] {
                let aim = aim.as_ref();
                let sample = |i| bsdf.sample_refracted(wo, aim, floor, random(i).next_2d());
                let name = format!("refracted {:?} {wo} {floor}", bsdf.parameters());
                let pdf = |refracted| bsdf.refracted_pdf(wo, aim, floor, refracted);
                check(&name, TESTS, pdf, |i| sample(i).map(|(refracted, _)| refracted));
            }
        }
    }
}

#[test]
fn directions_at_the_entry_have_their_density() {
    for bsdf in plies() {
        for wo in views() {
            let (_, crossing) = passage(&bsdf, wo);
            let mut passed = 0.0;
            let sample = |i| match bsdf.sample_entry(wo, &crossing, &mut random(i)) {
                Choice::Scatter(wi) => Some(wi),
                Choice::Pass => {
                    passed += 1.0;
                    None
                }
                Choice::Lost => None,
            };
            let name = format!("entry {:?} {wo}", bsdf.parameters());
            check(&name, TESTS, |wi| bsdf.pdf_entry(wo, &crossing, wi), sample);
            let chance = crossing.entry_probabilities[2];
            let error = (chance * (1.0 - chance) / 1e5).sqrt();
            assert!((passed / 1e5 - chance).abs() < 4.0 * error, "{name} {passed} {chance}");
        }
    }
}

#[test]
fn directions_at_the_exit_have_their_density() {
    for bsdf in plies() {
        for wo in views() {
            let (passage, crossing) = passage(&bsdf, wo);
            let sample = |i| match bsdf.sample_exit(&passage, &crossing, &mut random(i)) {
                Choice::Scatter(wi) => Some(wi),
                Choice::Pass | Choice::Lost => None,
            };
            let name = format!("exit {:?} {wo}", bsdf.parameters());
            check(&name, TESTS, |wi| bsdf.pdf_exit(&passage, &crossing, wi), sample);
        }
    }
}

/// Where plies touch there is no mirror at x, and at y light goes straight on or out of the body.
#[test]
fn directions_between_plies_that_touch_have_their_density() {
    let [some, _, dense] = plies();
    for bsdf in [some, dense] {
        for floor in [0.0, 0.1] {
            let wo = views()[0];
            let (passage, crossing) = passage_with(&bsdf, wo, [false; 2], floor);
            let name = format!("{:?} {floor}", bsdf.parameters());
            let mut straight = 0.0;
            let entry = |i| match bsdf.sample_entry(wo, &crossing, &mut random(i)) {
                Choice::Scatter(wi) => Some(wi),
                Choice::Pass | Choice::Lost => None,
            };
            check(&name, TESTS, |wi| bsdf.pdf_entry(wo, &crossing, wi), entry);
            let exit = |i| match bsdf.sample_exit(&passage, &crossing, &mut random(i)) {
                Choice::Scatter(wi) => Some(wi),
                Choice::Pass => {
                    straight += 1.0;
                    None
                }
                Choice::Lost => None,
            };
            check(&name, TESTS, |wi| bsdf.pdf_exit(&passage, &crossing, wi), exit);
            let chance = crossing.exit_probabilities[0];
            let error = (chance * (1.0 - chance) / 1e5).sqrt();
            assert!((straight / 1e5 - chance).abs() < 4.0 * error, "{name} {straight} {chance}");
        }
    }
}

/// Between plies that touch, what is not absorbed on the way is scattered by the body.
#[test]
fn light_between_plies_that_touch_is_attenuated_alone() {
    for bsdf in plies() {
        let (passage, crossing) = passage_with(&bsdf, views()[0], [false; 2], 0.0);
        let terms = crossing.passage.unwrap().1;
        let transmittance = (-bsdf.parameters().extinction * passage.length).exp();
        assert!((terms.entered - 1.0).abs() < 1e-15);
        assert!((terms.body - (1.0 - transmittance)).abs() < 1e-15);
        let p = bsdf.parameters();
        let expected = p.specular_tint * p.transmission_tint * transmittance;
        assert!((bsdf.eval_straight(&terms) - expected).abs().max_element() < 1e-15);
    }
}

/// However dark a lobe is, a floor keeps it likely; what no parameters switch on stays impossible.
#[test]
fn floors_keep_every_lobe_likely() {
    let dark = PlyParameters {
        specular_tint: Rgb::ZERO,
        transmission_tint: Rgb::ZERO,
        transmitted_color: Rgb::ZERO,
        body_reflection: 0.0,
        ..parameters()
    };
    let bsdf = PlyBsdf::new(dark).unwrap();
    let (_, crossing) = passage_with(&bsdf, views()[0], [true; 2], 0.1);
    assert!(crossing.entry_probabilities.iter().all(|&p| p >= 0.1 / 1.3));
    assert!(crossing.exit_probabilities.iter().all(|&p| p >= 0.1 / 1.3));
    let (_, touching) = passage_with(&bsdf, views()[0], [false; 2], 0.1);
    assert_eq!(touching.entry_probabilities[0], 0.0);
    for crossing in [crossing, touching] {
        assert!((crossing.entry_probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!((crossing.exit_probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
}

#[test]
fn weights_of_a_ply_average_to_its_integrals() {
    let n = 20_000;
    let value = |choice, eval: &dyn Fn(DVec3) -> f64, pdf: &dyn Fn(DVec3) -> f64| match choice {
        Choice::Scatter(wi) => eval(wi) / pdf(wi),
        Choice::Pass | Choice::Lost => 0.0,
    };
    for bsdf in plies() {
        for wo in views() {
            let (passage, crossing) = passage(&bsdf, wo);
            let terms = crossing.passage.unwrap().1;
            let eval = |wi| bsdf.eval_entry(wo, &crossing, wi).y;
            let pdf = |wi| bsdf.pdf_entry(wo, &crossing, wi);
            let sampled = mean(
                (0..n)
                    .map(|i| value(bsdf.sample_entry(wo, &crossing, &mut random(i)), &eval, &pdf)),
            );
            agree(sampled, sphere_integral(eval), "entry");
            let eval = |wi| bsdf.eval_exit(&passage, &terms, wi).y;
            let pdf = |wi| bsdf.pdf_exit(&passage, &crossing, wi);
            let sampled = mean((0..n).map(|i| {
                value(bsdf.sample_exit(&passage, &crossing, &mut random(i)), &eval, &pdf)
            }));
            agree(sampled, sphere_integral(eval), "exit");
        }
    }
}

/// On average over facets at y, the body gets what is not refracted there: what is refracted, what
/// is blocked on the way out, and the body's part add up to what entered.
#[test]
fn the_body_gets_exactly_what_is_not_refracted_at_the_exit() {
    for bsdf in plies() {
        let p = bsdf.parameters();
        let exit = RoughDielectric { eta: p.eta.recip(), ggx: p.exit_roughness };
        let tau = (-p.extinction * 0.4).exp();
        for wo in views() {
            let (first, crossing) = passage(&bsdf, wo);
            let entered = crossing.passage.unwrap().1.entered;
            let n = 20_000;
            let body = mean((0..n).map(|i| {
                let u = random(i).next_2d();
                let refracted = (first.refracted, first.refracted_pdf);
                let passage =
                    bsdf.sample_passage([true; 2], refracted, first.facet.incident, 0.4, u);
                bsdf.crossing(wo, Some(passage), Rgb::ONE, 0.0).passage.unwrap().1.body
            }));
            // By the visible normals at y: what refraction lets out before any is blocked.
            let passed = sphere_integral(|h| {
                let refracted = 1.0 - fresnel(first.facet.incident.dot(h).max(0.0), exit.eta);
                visible(&exit.ggx, first.facet.incident, h) * refracted
            });
            agree(body, 1.0 - tau * passed, "body");
            let interface = RoughDielectric { eta: p.eta, ggx: p.roughness };
            let value = interface.refraction(&constant(wo), &constant(first.refracted));
            assert!((entered * first.refracted_pdf - value).abs() < 1e-12 * value);
            // Without the colours, the refracted part at y is this much of what entered.
            let [_, refraction] = albedos(&exit, first.facet.incident);
            let terms = crossing.passage.unwrap().1;
            let all = sphere_integral(|wi| bsdf.eval_exit(&first, &terms, wi).y);
            let scattered = p.transmitted_color.y * (1.0 - p.body_reflection) * terms.body;
            let expected = p.transmission_tint.y * tau * refraction + scattered;
            let all = all / (p.specular_tint.y * entered);
            assert!((all - expected).abs() < 3e-3, "{all} {expected}");
        }
    }
}

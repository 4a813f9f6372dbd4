//! Every lobe of a ply, and every aim, against its density; and the energy that lobes pass on.

mod common;

use common::chi2::{check, sphere_integral};
use common::lobes::{TESTS, agree, albedos, ggx, mean, random, views, visible};
use common::parameters;
use glam::DVec3;
use plycloth::math::color::Rgb;
use plycloth::math::dual::constant;
use plycloth::math::frame::Frame;
use plycloth::sampling::warp::{square_to_cosine_hemisphere, square_to_cosine_hemisphere_pdf};
use plycloth::scatter::aim::Aim;
use plycloth::scatter::dielectric::RoughDielectric;
use plycloth::scatter::fresnel::fresnel;
use plycloth::scatter::halo::Halo;
use plycloth::scatter::passage::Passage;
use plycloth::scatter::ply::{Choice, Crossing, PlyBsdf, PlyParameters};
use plycloth::scatter::ribbon::Ribbon;

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

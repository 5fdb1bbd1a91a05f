//! The tangent against central differences of the residual.

use super::*;

/// Largest error of each of the three tangents at a state made from `seed`, relative to the largest entry of its column.
fn tangent_error(scene: &Scene, seed: u64, motion: Option<[f64; 3]>) -> f64 {
    let mut model = Modal::new(scene);
    let n = model.degrees_of_freedom();
    let mut random = random(seed);
    let angle: Vec<bool> = (0..n).map(|k| model.chain.is_angle(k)).collect();
    let mut state =
        |small: f64, large: f64| -> Vec<f64> { angle.iter().map(|a| random() * if *a { large } else { small }).collect() };
    let (mut q, v, a) = (state(0.03, 3.0), state(1.0, 20.0), state(50.0, 300.0));
    for link in &model.chain.links {
        q[link.at + link.bending..link.at + link.coordinates()].iter_mut().for_each(|e| *e *= 1e-3);
    }
    let input = Input { torque_nm: 3.0, motion };
    let mut worst = 0.0_f64;
    for (kind, w) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
        let w = Weights { acceleration: w[0], velocity: w[1], position: w[2] };
        let mut r = vec![0.0; n];
        model.chain.residual(&input, &q, &v, &a, &mut r);
        let matrix = model.tangent.assemble(&mut model.chain, &a, w).to_vec();
        for j in 0..n {
            let mut columns = vec![vec![0.0; n]; 4];
            let h = [[100.0, 1.0, 4e-4][kind], [10.0, 0.1, 4e-5][kind]][usize::from(!angle[j])];
            for (s, column) in [1.0, -1.0, 2.0, -2.0].into_iter().zip(&mut columns) {
                let (mut q, mut v, mut a) = (q.clone(), v.clone(), a.clone());
                [&mut a, &mut v, &mut q][kind][j] += s * h;
                model.residual(&input, &q, &v, &a, column);
            }
            let size = (0..n).fold(1e-30, |m: f64, i| m.max(matrix[i * n + j].abs()));
            for i in 0..n {
                let difference = (8.0 * (columns[0][i] - columns[1][i]) - (columns[2][i] - columns[3][i])) / (12.0 * h);
                worst = worst.max((difference - matrix[i * n + j]).abs() / size);
            }
        }
    }
    worst
}

#[test]
fn prop_tangent_equals_differences() {
    for (name, scene) in every_chain() {
        for seed in 0..40 {
            let motion = (name == "driven").then_some([0.3 * seed as f64, 12.0, 40.0]);
            let error = tangent_error(&scene, seed, motion);
            assert!(error < 1e-7, "{name} {seed}: {error:e}");
        }
    }
}

//! Sampling of tabulated functions of one and two variables (piecewise constant).

/// A piecewise constant density over `0..n` cells.
#[derive(Debug, Clone)]
pub struct Distribution1d {
    /// Running sums of the weights, from 0 to 1.
    cumulative: Vec<f64>,
    total: f64,
}

impl Distribution1d {
    /// The density proportional to `weights` (finite, non-negative); uniform if all are zero.
    pub fn new(weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        let mut sum = 0.0;
        let mut cumulative = vec![0.0];
        cumulative.extend(weights.iter().map(|weight| {
            sum += if total > 0.0 { weight * scale } else { 1.0 / weights.len() as f64 };
            sum
        }));
        cumulative[weights.len()] = 1.0;
        Self { cumulative, total }
    }

    /// The sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// The probability of `cell`.
    pub fn probability(&self, cell: usize) -> f64 {
        self.cumulative[cell + 1] - self.cumulative[cell]
    }

    /// The cell that `u` in [0, 1) falls into, and where in it, in [0, 1).
    pub fn sample(&self, u: f64) -> (usize, f64) {
        let cells = self.cumulative.len() - 1;
        let cell = (self.cumulative.partition_point(|&c| c <= u) - 1).min(cells - 1);
        (
            cell,
            ((u - self.cumulative[cell]) / self.probability(cell)).clamp(0.0, 1.0 - f64::EPSILON),
        )
    }
}

/// A piecewise constant density over the cells of a `height` x `width` table.
#[derive(Debug, Clone)]
pub struct Distribution2d {
    rows: Distribution1d,
    columns: Vec<Distribution1d>,
}

impl Distribution2d {
    /// The density proportional to `weights`, row-major with `width` columns.
    pub fn new(weights: &[f64], width: usize) -> Self {
        let columns: Vec<_> = weights.chunks_exact(width).map(Distribution1d::new).collect();
        let totals: Vec<_> = columns.iter().map(Distribution1d::total).collect();
        Self { rows: Distribution1d::new(&totals), columns }
    }

    /// A point (x, y) of the unit square and its density with respect to area.
    pub fn sample(&self, [u, v]: [f64; 2]) -> ([f64; 2], f64) {
        let (row, y) = self.rows.sample(v);
        let (column, x) = self.columns[row].sample(u);
        let (width, height) = self.size();
        let point = [(column as f64 + x) / width as f64, (row as f64 + y) / height as f64];
        (point, self.cell_pdf(column, row))
    }

    /// The density at a point (x, y) of the unit square.
    pub fn pdf(&self, [x, y]: [f64; 2]) -> f64 {
        let (width, height) = self.size();
        let cell = |t: f64, n: usize| ((t * n as f64) as usize).min(n - 1);
        self.cell_pdf(cell(x, width), cell(y, height))
    }

    fn cell_pdf(&self, column: usize, row: usize) -> f64 {
        let (width, height) = self.size();
        let probability = self.rows.probability(row) * self.columns[row].probability(column);
        probability * (width * height) as f64
    }

    fn size(&self) -> (usize, usize) {
        (self.columns[0].cumulative.len() - 1, self.columns.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_met_as_often_as_they_weigh() {
        let distribution = Distribution2d::new(&[0.0, 1.0, 3.0, 4.0], 2);
        let n = 200;
        let mut counts = [0usize; 4];
        for i in 0..n * n {
            let u = [((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64];
            let ([x, y], pdf) = distribution.sample(u);
            assert_eq!(pdf, distribution.pdf([x, y]));
            counts[(y >= 0.5) as usize * 2 + (x >= 0.5) as usize] += 1;
        }
        for (count, weight) in counts.iter().zip([0.0, 0.125, 0.375, 0.5]) {
            assert!((*count as f64 / (n * n) as f64 - weight).abs() < 0.01, "{counts:?}");
        }
    }

    #[test]
    fn all_zero_is_uniform() {
        let distribution = Distribution1d::new(&[0.0; 4]);
        assert_eq!(distribution.sample(0.6), (2, 0.3999999999999999));
        assert_eq!(distribution.probability(0), 0.25);
    }
}

//! Forward derivatives: the scattering models are written once, over [`Real`], and run on `f64` to
//! make pictures and on [`Dual6`] to differentiate them.

use num_dual::{DualNumCopy, DualSVec64};

/// A number that may carry derivatives.
pub trait Real: DualNumCopy<Primitive = f64> {}

impl<T: DualNumCopy<Primitive = f64>> Real for T {}

/// A number with its derivatives with respect to six variables.
pub type Dual6 = DualSVec64<6>;

/// The `index`-th of six independent variables, at `value`.
pub fn variable(value: f64, index: usize) -> Dual6 {
    Dual6::from(value).derivative(index)
}

/// The six derivatives that `number` carries.
pub fn gradient(number: Dual6) -> [f64; 6] {
    let [derivatives] = number.eps.0.map_or([[0.0; 6]], Into::into);
    derivatives
}

/// A vector of [`Real`] numbers.
pub type Vector<T> = [T; 3];

/// The scalar product of two vectors.
#[inline]
pub fn dot<T: Real>(a: &Vector<T>, b: &Vector<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `vector` brought to unit length.
#[inline]
pub fn normalized<T: Real>(vector: &Vector<T>) -> Vector<T> {
    let scale = dot(vector, vector).sqrt().recip();
    vector.map(|component| component * scale)
}

/// A constant vector: one with no derivatives.
#[inline]
pub fn constant<T: Real>(vector: glam::DVec3) -> Vector<T> {
    vector.to_array().map(T::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::DualNum;

    #[test]
    fn gradient_of_a_product() {
        let (x, y) = (variable(3.0, 0), variable(5.0, 2));
        assert_eq!(gradient(x * y.powi(2)), [25.0, 0.0, 30.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn constants_carry_no_derivatives() {
        assert_eq!(gradient(Dual6::from(2.0)), [0.0; 6]);
    }
}

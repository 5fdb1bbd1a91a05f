//! Magnification of bending: automatic, so that bending is just visible, or chosen by the user.

/// Drawn bending over a link's length at which the automatic factor aims.
const COMFORTABLE: f64 = 0.08;
/// Drawn bending beyond which the factor shrinks at once.
const TOO_MUCH: f64 = 0.16;
/// Drawn bending below which the factor grows.
const TOO_LITTLE: f64 = 0.02;
/// Decay of the remembered peak per frame.
const FORGET: f64 = 0.9995;
/// Bending below this is round-off and is not magnified.
const ROUND_OFF: f64 = 1e-9;
/// Largest factor.
const LARGEST: f64 = 1e6;

/// The factor by which deflections are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Magnification {
    pub factor: f64,
    pub automatic: bool,
    peak: f64,
}

impl Default for Magnification {
    fn default() -> Self {
        Magnification { factor: 1.0, automatic: true, peak: 0.0 }
    }
}

impl Magnification {
    /// Adjusts to the present bending, over the link's length.
    pub(super) fn look(&mut self, bending: f64) {
        if !bending.is_finite() {
            return;
        }
        self.peak = (FORGET * self.peak).max(bending);
        let drawn = self.peak * self.factor;
        if self.automatic && !(TOO_LITTLE..=TOO_MUCH).contains(&drawn) {
            self.choose();
        }
    }

    fn choose(&mut self) {
        self.factor = if self.peak < ROUND_OFF { 1.0 } else { round(COMFORTABLE / self.peak) };
    }

    /// One size up or down: 1, 2, 5, 10, …
    pub(super) fn change(&mut self, up: bool) {
        self.automatic = false;
        self.factor = round(if up { self.factor * 2.6 } else { self.factor / 1.9 });
    }

    /// Returns to the automatic factor.
    pub(super) fn automatic(&mut self) {
        self.automatic = true;
        self.choose();
    }
}

/// Rounds down to 1, 2, 5, 10, …; at least 1.
fn round(wanted: f64) -> f64 {
    let wanted = wanted.clamp(1.0, LARGEST);
    let power = 10_f64.powf(wanted.log10().floor());
    let digit = [5.0, 2.0].into_iter().find(|digit| digit * power <= wanted * (1.0 + 1e-9)).unwrap_or(1.0);
    digit * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_factors_go_by_one_two_five() {
        let mut by_hand = Magnification::default();
        let up: Vec<f64> = (0..6).map(|_| (by_hand.change(true), by_hand.factor).1).collect();
        assert_eq!(up, [2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
        let down: Vec<f64> = (0..7).map(|_| (by_hand.change(false), by_hand.factor).1).collect();
        assert_eq!(down, [50.0, 20.0, 10.0, 5.0, 2.0, 1.0, 1.0]);
    }

    #[test]
    fn prop_bending_is_drawn_large_enough_to_be_seen_and_not_larger() {
        for bending in [1e-7, 3e-5, 2e-3, 0.01, 0.2, 0.5] {
            let mut automatic = Magnification::default();
            automatic.look(bending);
            let drawn = bending * automatic.factor;
            assert!(drawn <= TOO_MUCH.max(bending) && drawn >= TOO_LITTLE, "{bending} drawn as {drawn}");
        }
    }

    #[test]
    fn prop_the_factor_holds_while_a_link_swings_and_round_off_is_not_magnified() {
        let mut automatic = Magnification::default();
        automatic.look(2e-3);
        let chosen = automatic.factor;
        for look in 0..100 {
            automatic.look(2e-3 * f64::from(look).sin().abs());
            assert!((automatic.factor - chosen).abs() < 1e-9);
        }
        let mut rigid = Magnification::default();
        rigid.look(1e-16);
        rigid.look(f64::NAN);
        assert!((rigid.factor - 1.0).abs() < 1e-12);
    }

    #[test]
    fn prop_automatic_chooses_again() {
        let mut factor = Magnification::default();
        factor.look(2e-3);
        let chosen = factor.factor;
        factor.change(true);
        factor.automatic();
        assert!((factor.factor - chosen).abs() < 1e-9 && factor.automatic);
    }
}

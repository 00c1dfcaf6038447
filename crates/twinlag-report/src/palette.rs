//! One palette for all figures: that of Okabe and Ito (2008), eight colours that remain distinct
//! with the common forms of colour blindness. Yellow is left out, since a thin yellow line is lost
//! on white paper; grey stands for what is background.

/// A colour of the palette.
///
/// Without one, a series takes the next free colour in the order of this list (grey excepted);
/// series of one name have one colour throughout a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "colours")]
#[non_exhaustive]
pub enum Colour {
    Blue,
    Vermilion,
    Green,
    Purple,
    Orange,
    Sky,
    Black,
    Grey,
}

/// The order in which colours are handed out.
pub(crate) const CYCLE: [Colour; 7] =
    [Colour::Blue, Colour::Vermilion, Colour::Green, Colour::Purple, Colour::Orange, Colour::Sky, Colour::Black];

impl Colour {
    /// The colour as a web colour.
    ///
    /// ```
    /// assert_eq!(twinlag_report::Colour::Blue.hex(), "#0072b2");
    /// ```
    pub fn hex(self) -> &'static str {
        match self {
            Self::Blue => "#0072b2",
            Self::Vermilion => "#d55e00",
            Self::Green => "#009e73",
            Self::Purple => "#cc79a7",
            Self::Orange => "#e69f00",
            Self::Sky => "#56b4e9",
            Self::Black => "#000000",
            Self::Grey => "#777777",
        }
    }
}

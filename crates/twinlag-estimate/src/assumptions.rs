//! The source and the assumptions of each estimator.

use crate::vocabulary::Estimator;

pub(crate) fn source(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::Whitened => {
            "functional maximum likelihood of errors in variables, exactly whitened; docs, chapter \
             \"Theory\", section 3"
        }
        Estimator::CrossRelation => {
            "Hung, McLoone, Irwin and Kee 2007, Gillespie, Hung, Kee and McLoone 2016 (abstracts seen)"
        }
        Estimator::BiasCompensated => {
            "Gillespie, Hung, Kee and McLoone 2016 (abstract seen), formula derived in docs, chapter \
             \"Theory\", section 2; with \
             the ratio of the levels alone, the level profiled by Dinkelbach's iteration"
        }
        Estimator::Normalised => {
            "docs, chapter \"Theory\", section 2; a published normalisation differs (its formula was not seen)"
        }
        Estimator::Hybrid => {
            "own interpretation of the published normalised and compensated hybrid, whose formula was not seen; \
             docs, chapter \
             \"Theory\", section 2"
        }
        Estimator::DifferenceEquationLs => "least squares on the difference equation, linear in two numbers",
        Estimator::DifferenceEquationTls => {
            "total least squares on the difference equation (Golub and Van \
            Loan 1980)"
        }
        Estimator::DifferenceEquationGtls => {
            "generalised total least squares on the difference equation (Van Huffel and Vandewalle 1989)"
        }
    }
}

pub(crate) fn assumes(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::Whitened => {
            "the sensors' order, the hold, independent noises, and the ratio of their levels, which it finds"
        }
        Estimator::CrossRelation => {
            "the sensors' order, the hold, and almost no noise: noise makes its time constants too long"
        }
        Estimator::BiasCompensated => {
            "the sensors' order, the hold, independent noises of known levels, or of a known ratio, and that \
             the filters have \
             settled after the samples that are discarded"
        }
        Estimator::Normalised => "as the compensated one, but only the ratio of the levels",
        Estimator::Hybrid => "as the compensated one; half as sensitive to a wrong level",
        Estimator::DifferenceEquationLs => {
            "no noise at all: noise biases it, towards short time constants if sensor 1 is the faster"
        }
        Estimator::DifferenceEquationTls => {
            "first-order sensors, and noise of one level that is independent between the columns, which it is \
             not: biased too"
        }
        Estimator::DifferenceEquationGtls => {
            "first-order sensors, white independent noises, and the ratio of their levels"
        }
    }
}

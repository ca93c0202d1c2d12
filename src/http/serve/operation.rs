//! Operations that need a model: what each defines, and the form in which all of them are served.
//!
//! An operation has types of its own for its request, its work and its answer. The steps of a request
//! (steps/) know none of them: they hold a parsed request as [`AnyRequest`], and the work on its models as
//! [`AnyWork`]. So all operations share one copy of the code that serves them.

use serde::de::DeserializeOwned;

use super::fitted::Fits;
use super::plan::{Cost, PlannedFits, PlannedSurface, PlannedValues};
use super::planner::{Planner, ValuesUse};
use crate::http::fields::HasCloud;
use crate::http::problem::Problem;
use gramian_host::compute::JobObserver;
use gramian_host::wire::negotiation::Format;
use gramian_host::wire::read::body::UnpackedBody;
use gramian_host::wire::read::limits::ParseContext;
use gramian_host::wire::write::answer::Answer;

/// A request with the operation that it is sent to.
pub trait Declared {
    /// Operation id in the OpenAPI document.
    const NAME: &'static str;

    type Answer: Answer + 'static;
}

/// A request that needs a model.
pub trait Operation: Declared + HasCloud + DeserializeOwned + Send + 'static {
    /// Inputs of `compute` that remain after the request is checked.
    type Work: Send + 'static;

    /// Formats of answers, the preferred one first. Answers of one matrix also have npy.
    const FORMATS: &'static [Format] = &[Format::Json, Format::Safetensors];

    /// What the request fits to values.
    fn values_use(&self) -> ValuesUse {
        ValuesUse::Nothing
    }

    /// Checks everything that can be checked without computing, the cost included.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn plan(self, planner: &Planner<'_>) -> Result<Plan<Self::Work>, Problem>;

    /// Computes the answer on the pool, from models that are ready.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn compute(work: Self::Work, fits: &Fits, observer: &JobObserver) -> Result<Self::Answer, Problem>;
}

/// Fits that an operation needs, and the work on them.
pub struct Plan<W> {
    pub fits: PlannedFits,
    pub work: W,
}

impl<W> Plan<W> {
    /// A plan for values alone.
    pub fn of_values(values: PlannedValues, work: W, cost: Cost) -> Self {
        let fits = PlannedFits { main: values.into(), surface: None, has_surface: false, cost };
        Self { fits, work }
    }

    /// A plan for the surface of a cloud.
    pub fn of_surface(surface: PlannedSurface, work: W, cost: Cost) -> Self {
        let fits = PlannedFits { main: surface.into(), surface: None, has_surface: true, cost };
        Self { fits, work }
    }

    /// A plan for values on a surface.
    pub fn on_surface(values: PlannedValues, surface: PlannedSurface, work: W, cost: Cost) -> Self {
        let surface = Some(surface.into());
        Self { fits: PlannedFits { main: values.into(), surface, has_surface: true, cost }, work }
    }
}

/// An operation without its types.
#[derive(Clone, Copy)]
pub struct AnyOperation {
    /// Operation id in the OpenAPI document.
    pub name: &'static str,
    /// Formats of answers, the preferred one first.
    pub formats: &'static [Format],
    /// Parses a body as a request of the operation.
    pub parse: Parse,
    /// Parses a body as a request of the operation that has the name of the operation as a further member.
    pub parse_named: Parse,
}

/// Parses a body. Returns the errors of [`UnpackedBody::parse`].
pub type Parse = fn(&UnpackedBody, &ParseContext<'_>) -> Result<Box<dyn AnyRequest>, Problem>;

impl AnyOperation {
    pub const fn of<O: Operation>() -> Self {
        Self {
            name: O::NAME,
            formats: O::FORMATS,
            parse: |body, context| Ok(Box::new(body.parse::<O>(context)?)),
            parse_named: |body, context| Ok(Box::new(body.parse_with_operation::<O>(context)?.request)),
        }
    }
}

/// A parsed request of any operation.
pub trait AnyRequest: HasCloud + Send {
    /// What the request fits to values.
    fn values_use(&self) -> ValuesUse;

    /// Checks everything that can be checked without computing, the cost included.
    ///
    /// # Errors
    /// Returns the errors of [`Operation::plan`].
    fn plan(self: Box<Self>, planner: &Planner<'_>) -> Result<Plan<Box<dyn AnyWork>>, Problem>;
}

impl<O: Operation> AnyRequest for O {
    fn values_use(&self) -> ValuesUse {
        Operation::values_use(self)
    }

    fn plan(self: Box<Self>, planner: &Planner<'_>) -> Result<Plan<Box<dyn AnyWork>>, Problem> {
        let Plan { fits, work } = Operation::plan(*self, planner)?;
        Ok(Plan { fits, work: Box::new(WorkOf::<O>(work)) })
    }
}

/// Work of any operation on models that are ready.
pub trait AnyWork: Send {
    /// Computes the answer on the pool.
    ///
    /// # Errors
    /// Returns the errors of [`Operation::compute`].
    fn compute(self: Box<Self>, fits: &Fits, observer: &JobObserver) -> Result<Box<dyn Answer>, Problem>;
}

struct WorkOf<O: Operation>(O::Work);

impl<O: Operation> AnyWork for WorkOf<O> {
    fn compute(self: Box<Self>, fits: &Fits, observer: &JobObserver) -> Result<Box<dyn Answer>, Problem> {
        Ok(Box::new(O::compute(self.0, fits, observer)?))
    }
}

//! From a parsed request to its plan.

use super::planned::PlannedRequest;
use super::{OnCall, Step};
use crate::http::fields::CloudInput;
use crate::http::problem::Problem;
use crate::http::serve::durable::{TRUST, find_cloud};
use crate::http::serve::operation::AnyRequest;
use crate::http::serve::planner::{LandmarkProbe, Planner, RequestClouds};
use crate::http::serve::sampling::find_landmarks;
use crate::store::key::CloudId;
use gramian_host::compute::{JobObserver, is_light};
use gramian_host::memory::budget::Reservation;
use gramian_numerics::points::duplicates::merging_flops;

/// A parsed request with its memory, and what is known of its clouds.
pub struct ParsedRequest {
    request: Box<dyn AnyRequest>,
    memory: Reservation,
    known: RequestClouds,
    /// Clouds of the request that have to be read from the store before it can be planned.
    absent: Vec<CloudId>,
    /// The question that has to be answered before `auto` can choose a solver.
    probe: Option<Box<LandmarkProbe>>,
}

impl ParsedRequest {
    /// Plans the request within the job that parsed it, if that is light work.
    ///
    /// # Errors
    /// Returns the refusals of the request.
    pub fn begin(
        on: &OnCall,
        request: Box<dyn AnyRequest>,
        memory: Reservation,
        observer: &JobObserver,
    ) -> Result<Step, Problem> {
        let mut parsed =
            Self { request, memory, known: RequestClouds::default(), absent: Vec::new(), probe: None };
        parsed.absent = parsed.ids_not_in_memory(on);
        if !parsed.absent.is_empty() || !is_light(parsed.planning_flops(on)) {
            return Ok(Step::Parsed(Box::new(parsed)));
        }
        parsed.planned(on, observer)
    }

    /// Finds what planning has to know, and plans the request.
    ///
    /// # Errors
    /// Returns the refusals of the request, and 503 if the store does not answer.
    pub async fn plan(mut self, on: &OnCall) -> Result<Step, Problem> {
        for id in std::mem::take(&mut self.absent) {
            self.known.clouds.extend(find_cloud(&on.app, on.owner(), id).await?);
        }
        if let Some(probe) = self.probe.take() {
            self.known.landmarks = Some(find_landmarks(&on.app, &on.call.admission, *probe).await?);
        }
        let flops = self.planning_flops(on);
        on.run(flops, move |on, observer| self.planned(on, observer)).await
    }

    fn planned(self, on: &OnCall, observer: &JobObserver) -> Result<Step, Problem> {
        let Self { mut request, memory, known, .. } = self;
        let mut planner = Planner::knowing(&on.app, on.owner(), known);
        let values_use = request.values_use();
        if let Some(probe) = planner.landmark_probe(&mut *request, values_use)? {
            let (known, probe) = (planner.into_known(), Some(Box::new(probe)));
            let parsed = Self { request, memory, known, absent: Vec::new(), probe };
            return Ok(Step::Parsed(Box::new(parsed)));
        }
        let plan = request.plan(&planner)?;
        let fresh = planner.into_known().fresh.into_inner();
        PlannedRequest::of(plan, memory, fresh).go_on(on, observer)
    }

    /// Finds the clouds that the request names and memory does not have, if there is a store to look in.
    fn ids_not_in_memory(&self, on: &OnCall) -> Vec<CloudId> {
        let (app, owner) = (&on.app, on.owner());
        if app.durable.is_none() {
            return Vec::new();
        }
        let named = [Some(self.request.cloud()), self.request.surface_cloud()].into_iter().flatten();
        let ids = named.filter_map(|cloud| CloudId::parse(cloud.id.as_deref()?));
        let is_at_hand = |id| app.clouds.get(owner, id).is_some_and(|cloud| cloud.is_trusted(TRUST));
        ids.filter(|&id| !is_at_hand(id)).collect()
    }

    /// Flops of planning, beside parsing: of merging points that coincide.
    fn planning_flops(&self, on: &OnCall) -> f64 {
        if !self.request.may_merge() {
            return 0.0;
        }
        let of_surface = self.request.surface_cloud().map_or(0, |cloud| self.n_points(cloud, on));
        merging_flops(self.n_points(self.request.cloud(), on)) + merging_flops(of_surface)
    }

    /// Number of points of a cloud of the request, 0 if the cloud is unknown.
    fn n_points(&self, cloud: &CloudInput, on: &OnCall) -> usize {
        let id = cloud.id.as_deref().and_then(CloudId::parse);
        let of_id = |id| {
            let found = self.known.clouds.iter().find(|cloud| cloud.id == id).cloned();
            found.or_else(|| on.app.clouds.get(on.owner(), id))
        };
        let registered = cloud.registered.clone().or_else(|| id.and_then(of_id));
        let of_points = || cloud.points.as_ref().map(|points| points.n_rows);
        registered.map(|cloud| cloud.cloud.n_points()).or_else(of_points).unwrap_or_default()
    }
}

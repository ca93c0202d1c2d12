//! From the bytes of a request to its plan.

use std::sync::Arc;
use std::time::Instant;

use axum::extract::Request;

use super::planned::Planned;
use super::{Call, Step};
use crate::http::compute::{JobObserver, is_light};
use crate::http::fields::CloudRef;
use crate::http::problem::Problem;
use crate::http::serve::durable::{TRUST, find_cloud};
use crate::http::serve::intake::{ReceivedBody, read_body};
use crate::http::serve::operation::{AnyOperation, AnyRequest, Parse, REQUEST_FORMATS};
use crate::http::serve::planner::{Known, LandmarkProbe, Planner};
use crate::http::serve::sampling::find_landmarks;
use crate::http::state::app::App;
use crate::http::wire::negotiation::Wanted;
use crate::http::wire::read::limits::ParseContext;
use crate::store::Owner;
use crate::store::budget::Reservation;
use crate::store::key::CloudId;
use gramian_numerics::points::duplicates::merging_flops;

/// A request whose body is read, with a place among threads and queue.
pub struct Received {
    pub body: ReceivedBody,
    pub parse: Parse,
}

impl Received {
    /// Settles the formats of body and answer, reads the body, and takes a place.
    ///
    /// # Errors
    /// 406, 408, 413, 415, or 503 if there is no place or no memory.
    pub async fn read(
        app: Arc<App>,
        owner: Owner,
        request: Request,
        operation: AnyOperation,
    ) -> Result<(Call, Self), Problem> {
        let (parts, body) = request.into_parts();
        let wanted = Some(Wanted::of(&parts.headers, operation.formats)?);
        let body = read_body(&app, owner, &parts.headers, body, &REQUEST_FORMATS).await?;
        let admission = app.compute.admit(owner)?;
        let AnyOperation { name, parse, .. } = operation;
        let call = Call { app, admission, operation: name, wanted, began: Instant::now() };
        Ok((call, Self { body, parse }))
    }

    /// Parses the request, and plans it if that is light work.
    ///
    /// # Errors
    /// Returns the refusals of the request.
    pub async fn parse(self, call: &Call) -> Result<Step, Problem> {
        let flops = self.body.body.flops_to_parse();
        let parse = move |call: &Call, observer: &JobObserver| {
            let mut parsed = self.parsed(call, observer)?;
            parsed.absent = parsed.ids_not_in_memory(call);
            if !parsed.absent.is_empty() || !is_light(parsed.planning_flops(call)) {
                return Ok(Step::Parsed(Box::new(parsed)));
            }
            parsed.planned(call, observer)
        };
        call.run(flops, parse).await
    }

    fn parsed(self, call: &Call, observer: &JobObserver) -> Result<Parsed, Problem> {
        let (body, memory) = self.body.unpack(&call.app, observer)?;
        let request = (self.parse)(&body, &ParseContext::new(&call.app.config, observer))?;
        Ok(Parsed { request, memory, known: Known::default(), absent: Vec::new(), probe: None })
    }
}

/// A parsed request with its memory, and what is known of its clouds.
pub struct Parsed {
    request: Box<dyn AnyRequest>,
    memory: Reservation,
    known: Known,
    /// Clouds of the request that have to be read from the store before it can be planned.
    absent: Vec<CloudId>,
    /// The question that has to be answered before `auto` can choose a solver.
    probe: Option<Box<LandmarkProbe>>,
}

impl Parsed {
    /// Finds what planning has to know, and plans the request.
    ///
    /// # Errors
    /// Returns the refusals of the request, and 503 if the store does not answer.
    pub async fn plan(mut self, call: &Call) -> Result<Step, Problem> {
        for id in std::mem::take(&mut self.absent) {
            self.known.clouds.extend(find_cloud(&call.app, call.admission.owner, id).await?);
        }
        if let Some(probe) = self.probe.take() {
            self.known.landmarks = Some(find_landmarks(&call.app, &call.admission, *probe).await?);
        }
        let flops = self.planning_flops(call);
        call.run(flops, move |call, observer| self.planned(call, observer)).await
    }

    fn planned(self, call: &Call, observer: &JobObserver) -> Result<Step, Problem> {
        let Self { mut request, memory, known, .. } = self;
        let mut planner = Planner::knowing(&call.app, call.admission.owner, known);
        let values_use = request.values_use();
        if let Some(probe) = planner.landmark_probe(&mut *request, values_use)? {
            let (known, probe) = (planner.into_known(), Some(Box::new(probe)));
            let parsed = Self { request, memory, known, absent: Vec::new(), probe };
            return Ok(Step::Parsed(Box::new(parsed)));
        }
        let plan = request.plan(&planner)?;
        let fresh = planner.into_known().fresh.into_inner();
        Planned::of(plan, memory, fresh).go_on(call, observer)
    }

    /// Finds the clouds that the request names and memory does not have, if there is a store to look in.
    fn ids_not_in_memory(&self, call: &Call) -> Vec<CloudId> {
        let (app, owner) = (&call.app, call.admission.owner);
        if app.durable.is_none() {
            return Vec::new();
        }
        let named = [Some(self.request.cloud()), self.request.surface_cloud()].into_iter().flatten();
        let ids = named.filter_map(|cloud| CloudId::parse(cloud.id.as_deref()?));
        let is_at_hand = |id| app.clouds.get(owner, id).is_some_and(|cloud| cloud.is_trusted(TRUST));
        ids.filter(|&id| !is_at_hand(id)).collect()
    }

    /// Flops of planning, beside parsing: of merging points that coincide.
    fn planning_flops(&self, call: &Call) -> f64 {
        if !self.request.may_merge() {
            return 0.0;
        }
        let of_surface = self.request.surface_cloud().map_or(0, |cloud| self.n_points(cloud, call));
        merging_flops(self.n_points(self.request.cloud(), call)) + merging_flops(of_surface)
    }

    /// Number of points of a cloud of the request, 0 if the cloud is unknown.
    fn n_points(&self, cloud: &CloudRef, call: &Call) -> usize {
        let id = cloud.id.as_deref().and_then(CloudId::parse);
        let of_id = |id| {
            let found = self.known.clouds.iter().find(|cloud| cloud.id == id).cloned();
            found.or_else(|| call.app.clouds.get(call.admission.owner, id))
        };
        let registered = cloud.registered.clone().or_else(|| id.and_then(of_id));
        let of_points = || cloud.points.as_ref().map(|points| points.n_rows);
        registered.map(|cloud| cloud.cloud.n_points()).or_else(of_points).unwrap_or_default()
    }
}

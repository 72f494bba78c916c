//! One row of the table of operations, and how it becomes an operation of the document.

use api::{Page, Problem, ProblemKind};
use utoipa::openapi::path::{HttpMethod, Operation, OperationBuilder, ParameterBuilder, ParameterIn};
use utoipa::openapi::request_body::RequestBodyBuilder;
use utoipa::openapi::response::ResponseBuilder;
use utoipa::openapi::schema::{KnownFormat, ObjectBuilder, Schema, SchemaFormat, Type};
use utoipa::openapi::security::SecurityRequirement;
use utoipa::openapi::{ContentBuilder, HeaderBuilder, Ref, RefOr, Required};
use utoipa::{PartialSchema as _, ToSchema};

/// Schemas by name, as they come together.
pub(super) type Schemas = Vec<(String, RefOr<Schema>)>;

/// What a parameter may be.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Text,
    /// A whole number from .. to.
    Whole(i64, i64),
    Number(f64, f64),
    Time,
    OneOf(&'static [&'static str]),
}

/// A parameter of a query.
#[derive(Debug, Clone, Copy)]
pub(in crate::http) struct Param {
    pub(in crate::http) name: &'static str,
    kind: Kind,
    what: &'static str,
    required: bool,
}

pub(super) const fn param(name: &'static str, kind: Kind, what: &'static str) -> Param {
    Param { name, kind, what, required: false }
}

pub(super) const fn required(name: &'static str, kind: Kind, what: &'static str) -> Param {
    Param { name, kind, what, required: true }
}

/// What comes back when all is well.
enum Answer {
    Json { name: String },
    Other { media_type: &'static str },
    Upgrade,
}

/// One operation: what the document says about a row of the table of routes.
pub(in crate::http) struct Doc {
    pub(in crate::http) method: &'static str,
    pub(in crate::http) path: &'static str,
    tag: &'static str,
    id: &'static str,
    pub(in crate::http) summary: &'static str,
    more: &'static str,
    pub(in crate::http) params: Vec<Param>,
    body: Option<String>,
    /// No body is the same as `{}`.
    body_may_be_empty: bool,
    answer: Answer,
    status: u16,
    also: Vec<(u16, &'static str)>,
    headers: Vec<(&'static str, &'static str)>,
    problems: Vec<ProblemKind>,
    schemas: Schemas,
    /// Whoever comes has nothing to show yet: no token, no key.
    is_door: bool,
}

fn doc(method: &'static str, path: &'static str, tag: &'static str, id: &'static str) -> Doc {
    Doc {
        method,
        path,
        tag,
        id,
        summary: "",
        more: "",
        params: Vec::new(),
        body: None,
        body_may_be_empty: false,
        answer: Answer::Upgrade,
        status: 200,
        also: Vec::new(),
        headers: Vec::new(),
        problems: Vec::new(),
        schemas: Vec::new(),
        is_door: false,
    }
}

/// A read.
pub(super) fn get(path: &'static str, tag: &'static str, id: &'static str, summary: &'static str) -> Doc {
    Doc { summary, ..doc("GET", path, tag, id) }
}

/// A write.
pub(super) fn post(path: &'static str, tag: &'static str, id: &'static str, summary: &'static str) -> Doc {
    Doc { summary, ..doc("POST", path, tag, id) }
}

/// A write that takes something away.
pub(super) fn delete(path: &'static str, tag: &'static str, id: &'static str, summary: &'static str) -> Doc {
    Doc { summary, ..doc("DELETE", path, tag, id) }
}

impl Doc {
    pub(super) fn more(self, more: &'static str) -> Self {
        Self { more, ..self }
    }

    pub(super) fn query(mut self, params: &[Param]) -> Self {
        self.params.extend_from_slice(params);
        self
    }

    /// Who writes here has no token and needs no idempotency key.
    pub(super) fn door(self) -> Self {
        Self { is_door: true, ..self }
    }

    /// The answer is JSON of this shape.
    pub(super) fn json<T: ToSchema>(mut self) -> Self {
        let name = self.schema::<T>();
        Self { answer: Answer::Json { name }, ..self }
    }

    /// The answer is a page of these. Each list has its own name in the document.
    pub(super) fn page<T: ToSchema>(mut self) -> Self {
        self.schema::<T>();
        let name = format!("{}Page", T::name());
        self.schemas.push((name.clone(), Page::<T>::schema()));
        Self { answer: Answer::Json { name }, ..self }
    }

    /// The answer is something else.
    pub(super) fn media(self, media_type: &'static str) -> Self {
        Self { answer: Answer::Other { media_type }, ..self }
    }

    /// The body of the request.
    pub(super) fn body<T: ToSchema + serde::de::DeserializeOwned>(mut self) -> Self {
        self.body = Some(self.schema::<T>());
        self.body_may_be_empty = serde_json::from_str::<T>("{}").is_ok();
        self
    }

    /// Something is made: 201 with `Location`, and 200 when the request is repeated.
    pub(super) fn creates(mut self) -> Self {
        self.status = 201;
        self.also.push((200, "The same as before: the idempotency key is known."));
        self.headers.push(("location", "Where what was made can be read."));
        self
    }

    /// Another status with the same body.
    pub(super) fn also(mut self, status: u16, what: &'static str) -> Self {
        self.also.push((status, what));
        self
    }

    /// `ETag`, `If-None-Match`, and 304.
    pub(super) fn tagged(mut self) -> Self {
        self.headers.push(("etag", "Send it as If-None-Match: 304 as long as nothing has changed."));
        self
    }

    pub(super) fn header(mut self, name: &'static str, what: &'static str) -> Self {
        self.headers.push((name, what));
        self
    }

    pub(super) fn problems(mut self, kinds: &[ProblemKind]) -> Self {
        self.problems.extend_from_slice(kinds);
        self
    }

    /// A schema that is told beside the answer.
    pub(super) fn beside<T: ToSchema>(mut self) -> Self {
        self.schema::<T>();
        self
    }

    fn schema<T: ToSchema>(&mut self) -> String {
        T::schemas(&mut self.schemas);
        let name = T::name().into_owned();
        self.schemas.push((name.clone(), T::schema()));
        name
    }

    fn is_write(&self) -> bool {
        self.method != "GET"
    }

    fn is_tagged(&self) -> bool {
        self.headers.iter().any(|(name, _)| *name == "etag")
    }

    pub(super) fn http_method(&self) -> HttpMethod {
        match self.method {
            "POST" => HttpMethod::Post,
            "DELETE" => HttpMethod::Delete,
            _ => HttpMethod::Get,
        }
    }

    /// The names between braces.
    pub(in crate::http) fn path_params(&self) -> impl Iterator<Item = &'static str> {
        self.path.split('{').skip(1).filter_map(|rest| rest.split('}').next())
    }

    /// Everything that may go wrong, by status.
    fn all_problems(&self) -> Vec<ProblemKind> {
        use ProblemKind as K;
        let mut all = self.problems.clone();
        all.extend([K::HostRefused, K::NotAcceptable, K::Internal, K::TokenRefused]);
        if self.tag != "server" {
            all.extend([K::LoginRequired, K::Forbidden]);
        }
        if !self.params.is_empty() || self.path_params().next().is_some() {
            all.push(K::BadParameter);
        }
        if self.path.starts_with("/api/v1/") && self.tag != "server" {
            all.push(K::StorageFailing);
        }
        if self.is_write() {
            all.extend([
                K::OriginRefused,
                K::WrongMediaType,
                K::BodyTooLarge,
                K::BadJson,
                K::WrongShape,
                K::Overloaded,
                K::Stopping,
            ]);
        }
        if self.is_write() && !self.is_door {
            all.extend([K::Csrf, K::IdempotencyKeyRequired, K::IdempotencyKeyReused]);
        }
        all.sort_by_key(|kind| (kind.status(), kind.word()));
        all.dedup();
        all
    }

    /// The operation, and the schemas that it speaks of.
    pub(super) fn build(mut self) -> (Operation, Schemas) {
        let mut operation = OperationBuilder::new()
            .tag(self.tag)
            .operation_id(Some(self.id))
            .summary(Some(self.summary))
            .description((!self.more.is_empty()).then_some(self.more));
        for name in self.path_params() {
            let schema = match name {
                "id" if !self.path.contains("/links/") && !self.path.contains("/keys/") => {
                    schema(Kind::Whole(0, i64::MAX))
                }
                _ => schema(Kind::Text),
            };
            let parameter = ParameterBuilder::new()
                .name(name)
                .parameter_in(ParameterIn::Path)
                .required(Required::True)
                .schema(Some(schema));
            operation = operation.parameter(parameter);
        }
        for param in &self.params {
            operation = operation.parameter(
                ParameterBuilder::new()
                    .name(param.name)
                    .parameter_in(ParameterIn::Query)
                    .required(if param.required { Required::True } else { Required::False })
                    .description(Some(param.what))
                    .schema(Some(schema(param.kind))),
            );
        }
        if self.is_write() && !self.is_door {
            operation = operation.parameter_ref(Ref::new("#/components/parameters/IdempotencyKey"));
            operation = operation.security(SecurityRequirement::new("token", std::iter::empty::<String>()));
        }
        if let Some(name) = &self.body {
            let content = ContentBuilder::new().schema(Some(Ref::from_schema_name(name)));
            operation = operation.request_body(Some(
                RequestBodyBuilder::new()
                    .content("application/json", content.build())
                    .required(Some(if self.body_may_be_empty { Required::False } else { Required::True }))
                    .build(),
            ));
        }
        let said = match self.status {
            101 => "The WebSocket is open.",
            201 => "Done, durably.",
            _ if self.is_write() => "Done, durably.",
            _ => "As asked.",
        };
        operation = operation.response(self.status.to_string(), self.success(said));
        for (status, what) in &self.also {
            operation = operation.response(status.to_string(), self.success(what));
        }
        if self.is_tagged() {
            let unchanged = ResponseBuilder::new().description("What you hold is still the same.");
            operation = operation.response("304", unchanged.build());
        }
        let problems = self.all_problems();
        let mut statuses: Vec<u16> = problems.iter().map(|kind| kind.status()).collect();
        statuses.dedup();
        for status in statuses {
            // An answer of its own goes first, as that of a server that is not ready.
            if self.also.iter().any(|(also, _)| *also == status) {
                continue;
            }
            let words: Vec<String> = problems
                .iter()
                .filter(|kind| kind.status() == status)
                .map(|kind| format!("`{}`", kind.word()))
                .collect();
            let content = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem")));
            let response = ResponseBuilder::new()
                .description(words.join(", "))
                .content("application/problem+json", content.build());
            operation = operation.response(status.to_string(), response.build());
        }
        <Problem as ToSchema>::schemas(&mut self.schemas);
        (operation.build(), self.schemas)
    }

    fn success(&self, what: &str) -> utoipa::openapi::Response {
        let mut response = ResponseBuilder::new().description(what);
        match &self.answer {
            Answer::Json { name } => {
                let content = ContentBuilder::new().schema(Some(Ref::from_schema_name(name)));
                response = response.content("application/json", content.build());
            }
            Answer::Other { media_type } => {
                let text = ObjectBuilder::new().schema_type(Type::String);
                let text = match media_type.starts_with("image/jpeg") {
                    true => text.format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary))),
                    false => text,
                };
                let content = ContentBuilder::new().schema(Some(Schema::Object(text.build())));
                response = response.content(*media_type, content.build());
            }
            Answer::Upgrade => {}
        }
        for (name, what) in &self.headers {
            let header = HeaderBuilder::new()
                .description(Some(*what))
                .schema(Some(Schema::Object(ObjectBuilder::new().schema_type(Type::String).build())));
            response = response.header(*name, header.build());
        }
        response.build()
    }

    /// It opens a WebSocket.
    pub(super) fn upgrades(self) -> Self {
        Self { status: 101, answer: Answer::Upgrade, ..self }
    }
}

fn schema(kind: Kind) -> RefOr<Schema> {
    let object = ObjectBuilder::new();
    let object = match kind {
        Kind::Text => object.schema_type(Type::String),
        Kind::Whole(from, to) => {
            let object = object
                .schema_type(Type::Integer)
                .format(Some(SchemaFormat::KnownFormat(KnownFormat::Int64)))
                .minimum((from > i64::MIN).then_some(from));
            object.maximum((to < i64::MAX).then_some(to))
        }
        Kind::Number(from, to) => object.schema_type(Type::Number).minimum(Some(from)).maximum(Some(to)),
        Kind::Time => object
            .schema_type(Type::String)
            .format(Some(SchemaFormat::KnownFormat(KnownFormat::DateTime)))
            .examples(["2026-11-22T05:19:25.123Z"]),
        Kind::OneOf(words) => object.schema_type(Type::String).enum_values(Some(words.iter().copied())),
    };
    RefOr::T(Schema::Object(object.build()))
}

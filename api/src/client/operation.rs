//! Operations of the API: what each method of the client asks for, said once. The list of all of them and the requests
//! themselves are made of the same words.

use super::segment;

/// An operation of the API.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Operation {
    /// `GET`, `POST` or `DELETE`.
    pub method: &'static str,
    /// Its path below `/api/v1/`; what is filled in stands in braces, as in `frames/{id}`.
    pub path: &'static str,
}

impl Operation {
    pub(super) const fn get(path: &'static str) -> Self {
        Self { method: "GET", path }
    }

    pub(super) const fn post(path: &'static str) -> Self {
        Self { method: "POST", path }
    }

    pub(super) const fn delete(path: &'static str) -> Self {
        Self { method: "DELETE", path }
    }

    /// The path with this in the place of what stands in braces.
    pub(super) fn of(self, what: &dyn std::fmt::Display) -> String {
        match (self.path.find('{'), self.path.find('}')) {
            (Some(from), Some(to)) => {
                [&self.path[..from], &segment(&what.to_string()), &self.path[to + 1..]].concat()
            }
            _ => self.path.to_owned(),
        }
    }
}

/// Methods for operations of one form each, and a constant of that name with all of these operations.
macro_rules! operations {
    // What is read as it is.
    ($table:ident, read: $($(#[$meta:meta])* $name:ident -> $answer:ty = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::get($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(&self) -> Result<$answer, ClientError> {
                self.get(Operation::get($path).path, &Filter::new()).await
            })*
        }
    };
    // What is read with parameters.
    ($table:ident, list: $($(#[$meta:meta])* $name:ident -> $answer:ty = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::get($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(&self, filter: &Filter) -> Result<$answer, ClientError> {
                self.get(Operation::get($path).path, filter).await
            })*
        }
    };
    // Words and pictures.
    ($table:ident, text: $($(#[$meta:meta])* $name:ident = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::get($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(&self, filter: &Filter) -> Result<String, ClientError> {
                self.text(Operation::get($path).path, filter).await
            })*
        }
    };
    // What has a number or a name.
    ($table:ident, one: $($(#[$meta:meta])* $name:ident($of:ty) -> $answer:ty = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::get($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(&self, of: $of) -> Result<$answer, ClientError> {
                self.get(&Operation::get($path).of(&of), &Filter::new()).await
            })*
        }
    };
    // What is done without more words.
    ($table:ident, act: $($(#[$meta:meta])* $name:ident -> $answer:ty = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::post($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(&self, key: &IdempotencyKey) -> Result<$answer, ClientError> {
                self.post(Operation::post($path).path, &Nothing {}, key).await
            })*
        }
    };
    // The same on something that has a number or a name.
    ($table:ident, verb: $($(#[$meta:meta])* $name:ident($of:ty) -> $answer:ty = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::post($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(&self, of: $of, key: &IdempotencyKey) -> Result<$answer, ClientError> {
                self.post(&Operation::post($path).of(&of), &Nothing {}, key).await
            })*
        }
    };
    // What is given.
    ($table:ident, give: $($(#[$meta:meta])* $name:ident($body:ty) -> $answer:ty = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::post($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(&self, request: &$body, key: &IdempotencyKey) -> Result<$answer, ClientError> {
                self.post(Operation::post($path).path, request, key).await
            })*
        }
    };
    // What is told to something that has a number or a name.
    ($table:ident, tell: $($(#[$meta:meta])* $name:ident($of:ty, $body:ty) -> $answer:ty = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::post($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(
                &self,
                of: $of,
                request: &$body,
                key: &IdempotencyKey,
            ) -> Result<$answer, ClientError> {
                self.post(&Operation::post($path).of(&of), request, key).await
            })*
        }
    };
    // What is taken away.
    ($table:ident, remove: $($(#[$meta:meta])* $name:ident($of:ty) -> $answer:ty = $path:literal;)*) => {
        pub(super) const $table: &[Operation] = &[$(Operation::delete($path)),*];
        impl Client {
            $($(#[$meta])*
            ///
            /// # Errors
            /// [`ClientError`].
            pub async fn $name(&self, of: $of, key: &IdempotencyKey) -> Result<$answer, ClientError> {
                self.delete(&Operation::delete($path).of(&of), key).await
            })*
        }
    };
}

pub(super) use operations;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_filled_in_where_the_braces_are_and_stays_there() {
        assert_eq!(Operation::get("frames/{id}").of(&17), "frames/17");
        assert_eq!(Operation::post("plans/{name}/arm").of(&"../a"), "plans/%2E%2E%2Fa/arm");
        assert_eq!(Operation::get("station").of(&"x"), "station");
    }
}

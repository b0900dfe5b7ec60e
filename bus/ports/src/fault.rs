//! [`TransportFault`]: why iceoryx2 could not do something, in one enum. iceoryx2's own errors have
//! another type for each call.

use std::io;

use iceoryx2::node::{NodeCreationFailure, NodeListFailure};
use iceoryx2::port::client::RequestSendError;
use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::port::{LoanError, ReceiveError, SendError};
use iceoryx2::service::ServiceListError;
use iceoryx2::service::builder::event::{EventCreateError, EventOpenError};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError, PublishSubscribeOpenError,
};
use iceoryx2::service::builder::request_response::{
    RequestResponseCreateError, RequestResponseOpenError,
};
use iceoryx2::service::port_factory::client::ClientCreateError;
use iceoryx2::service::port_factory::server::ServerCreateError;

/// What went wrong in the transport.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TransportFault {
    /// Another process is creating or removing the same thing.
    #[error("another process is creating or removing it")]
    InMotion,
    /// The process that was creating it has not finished.
    #[error("the process that was creating it has not finished")]
    Unfinished,
    /// The contents of shared memory or of the bus's folder contradict each other.
    #[error("its shared files contradict each other")]
    Corrupted,
    /// A signal interrupted the call.
    #[error("a signal interrupted it")]
    Interrupted,
    /// The user has no permission to use it.
    #[error("the permission is missing")]
    Permission,
    /// There is no memory for samples.
    #[error("there is no shared memory for its samples")]
    NoMemory,
    /// A file in the bus's folder could not be written.
    #[error("its file in the bus's folder could not be written")]
    NoFile,
    /// The shared memory of the other process could not be opened.
    #[error("the shared memory of the other end could not be opened")]
    NoConnection,
    /// A limit of the service was exceeded.
    #[error("one of its limits is exceeded")]
    Limit,
    /// The name is too long for a service.
    #[error("its name is too long")]
    NameTooLong,
    /// The operating system refused a call.
    #[error("the system refused a call: {0}")]
    System(io::ErrorKind),
    /// The transport gives no other reason.
    #[error("the transport failed for another reason")]
    Internal,
}

impl From<io::Error> for TransportFault {
    fn from(error: io::Error) -> Self {
        Self::System(error.kind())
    }
}

/// What a failed attempt to open or to create a service means.
pub(crate) enum Refusal {
    /// Trying again may help.
    Passing(TransportFault),
    /// A running process uses the service with another layout or other limits.
    Differs(Difference),
    /// The user has no permission to use it.
    Permission,
    /// A process with another version of the transport has made it.
    Version,
    /// Too many processes have the service open.
    Crowded,
}

/// How a service in use differs from the one that this process would make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Difference {
    /// The payload's or the header's name, size or alignment.
    #[error("another type")]
    Type,
    /// The hash of the layout, which every process of this project states.
    #[error("another schema")]
    Schema,
    /// Buffers, places or other limits.
    #[error("other limits")]
    Limits,
    /// The kind of service.
    #[error("another kind of service")]
    Pattern,
    /// The board of bells in shared memory.
    #[error("its board in shared memory differs")]
    Board,
    /// The service has no description of its samples.
    #[error("it does not describe its samples")]
    Undescribed,
}

/// The conversions of errors that all three kinds of service have.
macro_rules! refusals {
    ($($error:ident: $($variant:ident)|* => $differs:expr;)*) => {
        $(impl From<$error> for Refusal {
            fn from(error: $error) -> Self {
                match error {
                    $error::InsufficientPermissions => Self::Permission,
                    $error::VersionMismatch => Self::Version,
                    $error::ExceedsMaxNumberOfNodes => Self::Crowded,
                    $error::IncompatibleMessagingPattern => Self::Differs(Difference::Pattern),
                    $error::IncompatibleAttributes => Self::Differs(Difference::Schema),
                    $( $error::$variant )|* => Self::Differs($differs),
                    $error::Interrupt => Self::Passing(TransportFault::Interrupted),
                    $error::DoesNotExist | $error::IsMarkedForDestruction => {
                        Self::Passing(TransportFault::InMotion)
                    }
                    $error::HangsInCreation => Self::Passing(TransportFault::Unfinished),
                    $error::ServiceInCorruptedState => Self::Passing(TransportFault::Corrupted),
                    $error::UnableToCreateServiceTag => Self::Passing(TransportFault::NoFile),
                    $error::InternalFailure => Self::Passing(TransportFault::Internal),
                    #[allow(unreachable_patterns, reason = "events have no other")]
                    _ => Self::Differs(Difference::Limits),
                }
            }
        })*
    };
}

refusals! {
    PublishSubscribeOpenError:
        IncompatibleTypes | UnableToAcquireTypeDefinition | InvalidTypeDefinition => Difference::Type;
    RequestResponseOpenError:
        IncompatibleRequestOrResponseType | UnableToAcquireTypeDefinition | InvalidTypeDefinition
            => Difference::Type;
    EventOpenError: IncompatibleDeadline => Difference::Limits;
}

macro_rules! creations {
    ($($error:ident)*) => {
        $(impl From<$error> for Refusal {
            fn from(error: $error) -> Self {
                Self::Passing(match error {
                    $error::InsufficientPermissions => return Self::Permission,
                    $error::AlreadyExists | $error::IsBeingCreatedByAnotherInstance => {
                        TransportFault::InMotion
                    }
                    $error::Interrupt => TransportFault::Interrupted,
                    $error::ServiceInCorruptedState => TransportFault::Corrupted,
                    $error::UnableToCreateServiceTag
                    | $error::ServiceConfigCouldNotBeCreated => TransportFault::NoFile,
                    _ => TransportFault::Internal,
                })
            }
        })*
    };
}

creations!(PublishSubscribeCreateError RequestResponseCreateError EventCreateError);

/// The conversions of errors of calls that are not tried again.
macro_rules! faults {
    ($($error:ident { $($($variant:ident)|+ => $fault:ident),* $(,)? })*) => {
        $(impl From<$error> for TransportFault {
            fn from(error: $error) -> Self {
                match error {
                    $( $( $error::$variant )|+ => Self::$fault, )*
                    #[allow(unreachable_patterns, reason = "not every error has others")]
                    _ => Self::Internal,
                }
            }
        })*
    };
}

faults! {
    NodeCreationFailure {
        InsufficientPermissions => Permission,
        SystemCorrupted => Corrupted,
    }
    NodeListFailure { InsufficientPermissions => Permission, Interrupt => Interrupted }
    ServiceListError { InsufficientPermissions => Permission }
    PublisherCreateError {
        ExceedsMaxSupportedPublishers => Limit,
        UnableToCreateDataSegment => NoMemory,
        UnableToCreatePortTag => NoFile,
    }
    SubscriberCreateError {
        ExceedsMaxSupportedSubscribers | BufferSizeExceedsMaxSupportedBufferSizeOfService => Limit,
        UnableToCreatePortTag => NoFile,
    }
    NotifierCreateError { ExceedsMaxSupportedNotifiers => Limit, UnableToCreatePortTag => NoFile }
    ClientCreateError {
        ExceedsMaxSupportedClients => Limit,
        UnableToCreateDataSegment => NoMemory,
        UnableToCreatePortTag => NoFile,
    }
    ServerCreateError {
        ExceedsMaxSupportedServers => Limit,
        UnableToCreateDataSegment => NoMemory,
        UnableToCreatePortTag => NoFile,
    }
    LoanError { OutOfMemory => NoMemory, ExceedsMaxLoans | ExceedsMaxLoanSize => Limit }
}

impl From<ReceiveError> for TransportFault {
    fn from(error: ReceiveError) -> Self {
        match error {
            ReceiveError::ExceedsMaxBorrows => Self::Limit,
            ReceiveError::ConnectionFailure(_) => Self::NoConnection,
        }
    }
}

impl From<SendError> for TransportFault {
    fn from(error: SendError) -> Self {
        match error {
            SendError::LoanError(error) => error.into(),
            SendError::ConnectionCorrupted => Self::Corrupted,
            SendError::ConnectionError(_)
            | SendError::ConnectionBrokenSinceSenderNoLongerExists
            | SendError::UnableToDeliver => Self::NoConnection,
            SendError::InternalError => Self::Internal,
        }
    }
}

impl From<RequestSendError> for TransportFault {
    fn from(error: RequestSendError) -> Self {
        match error {
            RequestSendError::ExceedsMaxActiveRequests => Self::Limit,
            RequestSendError::SendError(error) => error.into(),
        }
    }
}

//! The six parameter services on the wire, in the form of either of the two common middlewares.
//!
//! A request and its reply are two topics. Which request a reply is for stands in the header of the packet
//! (`rmw_fastrtps`), or in front of the content (`rmw_cyclonedds`: 8 bytes of the client, 8 bytes of number, sent back
//! as they came). A process speaks one of the two forms.

use super::environment::ServiceMapping;
use super::graph::{Graph, GraphError, Reader, WriteError, Writer};
use super::names::Names;
use super::parameters::{Change, ParameterStore};
use super::payload::Payload;
use super::qos::Qos;
use messages::builtin_interfaces::Time;
use messages::cdr::ENCAPSULATION_BYTES;
use messages::{DecodeError, Interface, Message};
use rustdds::no_key::DeserializedCacheChange;
use rustdds::{SampleIdentity, SequenceNumber};

/// Bytes in front of the content in the form of `rmw_cyclonedds`.
const CYCLONE_HEADER_BYTES: usize = 16;

/// A service of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterService {
    /// `get_parameters`
    Get,
    /// `get_parameter_types`
    Types,
    /// `set_parameters`
    Set,
    /// `set_parameters_atomically`
    SetAtomically,
    /// `describe_parameters`
    Describe,
    /// `list_parameters`
    List,
}

impl ParameterService {
    /// Every service.
    pub const ALL: [Self; 6] =
        [Self::Get, Self::Types, Self::Set, Self::SetAtomically, Self::Describe, Self::List];

    /// Name below `~/`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Get => "get_parameters",
            Self::Types => "get_parameter_types",
            Self::Set => "set_parameters",
            Self::SetAtomically => "set_parameters_atomically",
            Self::Describe => "describe_parameters",
            Self::List => "list_parameters",
        }
    }

    /// Type in `rcl_interfaces/srv/`.
    #[must_use]
    pub fn type_name(self) -> &'static str {
        match self {
            Self::Get => "GetParameters",
            Self::Types => "GetParameterTypes",
            Self::Set => "SetParameters",
            Self::SetAtomically => "SetParametersAtomically",
            Self::Describe => "DescribeParameters",
            Self::List => "ListParameters",
        }
    }

    /// Answers a request; the change is what follows from it, if anything does.
    fn answer(
        self,
        request: &[u8],
        store: &mut ParameterStore,
        now: Time,
    ) -> Result<(Vec<u8>, Option<Change>), DecodeError> {
        let answer = match self {
            Self::Get => (encoded(&store.get(&self.decoded(request)?)), None),
            Self::Types => (encoded(&store.types(&self.decoded(request)?)), None),
            Self::Describe => (encoded(&store.describe(&self.decoded(request)?)), None),
            Self::List => (encoded(&store.list(&self.decoded(request)?)), None),
            Self::Set => {
                let (response, change) = store.set(&self.decoded(request)?, now);
                (encoded(&response), change)
            }
            Self::SetAtomically => {
                let (response, change) = store.set_atomically(&self.decoded(request)?, now);
                (encoded(&response), change)
            }
        };
        Ok(answer)
    }

    fn decoded<M: Message>(self, request: &[u8]) -> Result<M, DecodeError> {
        M::from_cdr(request, Interface::default(), self.name())
    }
}

/// Parameters look the same in every release of Autoware.
fn encoded<M: Message>(message: &M) -> Vec<u8> {
    message.to_cdr(Interface::default())
}

/// The answering end of a service.
pub struct Server {
    service: ParameterService,
    mapping: ServiceMapping,
    /// Where requests come from.
    pub(super) requests: Reader,
    replies: Writer,
}

/// Why a request gets no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ServiceError {
    /// It is shorter than what stands in front of every request.
    #[error(
        "{service}: a request of {bytes} bytes has no header; does the client use rmw_cyclonedds_cpp, as this node does?"
    )]
    NoHeader {
        /// Name of the service.
        service: &'static str,
        /// Length of the request.
        bytes: usize,
    },
    /// It is no request.
    #[error("{0}; do client and node use the same RMW_IMPLEMENTATION?")]
    Malformed(#[from] DecodeError),
    /// The reply cannot be sent.
    #[error(transparent)]
    Reply(#[from] WriteError),
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server")
            .field("service", &self.service)
            .field("mapping", &self.mapping)
            .finish_non_exhaustive()
    }
}

impl Server {
    /// Opens all six services under their remapped names.
    ///
    /// # Errors
    /// A service cannot be opened.
    pub fn open_all(
        graph: &mut Graph,
        names: &Names,
        mapping: ServiceMapping,
    ) -> Result<Vec<Self>, GraphError> {
        ParameterService::ALL.into_iter().map(|service| Self::open(graph, names, mapping, service)).collect()
    }

    fn open(
        graph: &mut Graph,
        names: &Names,
        mapping: ServiceMapping,
        service: ParameterService,
    ) -> Result<Self, GraphError> {
        let name = names.service(&format!("~/{}", service.name()))?;
        let type_name = |part: &str| format!("rcl_interfaces::srv::dds_::{}_{part}_", service.type_name());
        let (request, reply) = (format!("rq{name}Request"), format!("rr{name}Reply"));
        let requests = graph.open_reader(&name, &request, &type_name("Request"), Qos::PARAMETERS)?;
        let replies = graph.open_writer(&name, &reply, &type_name("Response"), Qos::PARAMETERS)?;
        Ok(Self { service, mapping, requests, replies })
    }

    /// Answers one request.
    ///
    /// # Errors
    /// It cannot be answered; nothing has changed, except if only the reply was lost.
    pub fn serve(
        &self,
        request: &DeserializedCacheChange<Payload>,
        store: &mut ParameterStore,
        now: Time,
    ) -> Result<Option<Change>, ServiceError> {
        let bytes = request.sample.as_bytes();
        let (header, content) = match self.mapping {
            ServiceMapping::Enhanced => (Vec::new(), bytes.to_vec()),
            ServiceMapping::Cyclone => split(bytes)
                .ok_or(ServiceError::NoHeader { service: self.service.name(), bytes: bytes.len() })?,
        };
        let (reply, change) = self.service.answer(&content, store, now)?;
        let mut framed = reply[..ENCAPSULATION_BYTES].to_vec();
        framed.extend(header);
        framed.extend(&reply[ENCAPSULATION_BYTES..]);
        // A change that was accepted holds, whether or not the client hears of it.
        if let Err(error) = self.replies.answer(framed, identity(request)) {
            tracing::warn!("{error}");
        }
        Ok(change)
    }
}

/// Which request it is: what the client says itself, or the packet's own identity. A client of `rmw_fastrtps` names the
/// reader of its replies, but leaves the number to the packet.
fn identity(request: &DeserializedCacheChange<Payload>) -> SampleIdentity {
    let own = SampleIdentity { writer_guid: request.writer_guid(), sequence_number: request.sequence_number };
    match request.related_sample_identity() {
        None => own,
        Some(named) if named.sequence_number == SequenceNumber::UNKNOWN => {
            SampleIdentity { sequence_number: own.sequence_number, ..named }
        }
        Some(named) => named,
    }
}

/// The header in the byte order of our replies, and the request without it.
fn split(bytes: &[u8]) -> Option<(Vec<u8>, Vec<u8>)> {
    let (encapsulation, rest) = bytes.split_at_checked(ENCAPSULATION_BYTES)?;
    let (header, content) = rest.split_at_checked(CYCLONE_HEADER_BYTES)?;
    let is_little_endian = encapsulation[1] & 1 == 1;
    let header = header.chunks(8).flat_map(|number| {
        let mut number = number.to_vec();
        if !is_little_endian {
            number.reverse();
        }
        number
    });
    Some((header.collect(), [encapsulation, content].concat()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_of_cyclone_is_taken_off_and_sent_back() {
        let mut request = vec![0, 1, 0, 0];
        request.extend(0..16_u8);
        request.extend([42; 5]);
        let (header, content) = split(&request).unwrap();
        assert_eq!(header, (0..16).collect::<Vec<u8>>());
        assert_eq!(content, [0, 1, 0, 0, 42, 42, 42, 42, 42]);
    }

    #[test]
    fn numbers_of_a_big_endian_client_are_turned() {
        let mut request = vec![0, 0, 0, 0];
        request.extend(0..16_u8);
        let (header, content) = split(&request).unwrap();
        assert_eq!(header[..8], [7, 6, 5, 4, 3, 2, 1, 0]);
        assert_eq!(header[8..], [15, 14, 13, 12, 11, 10, 9, 8]);
        assert_eq!(content, [0, 0, 0, 0]);
    }

    #[test]
    fn a_request_without_header_is_refused() {
        for length in 0..ENCAPSULATION_BYTES + CYCLONE_HEADER_BYTES {
            assert_eq!(split(&vec![0; length]), None, "{length} bytes");
        }
    }
}

//! The six parameter services on the wire, in the form of either of the two common middlewares.
//!
//! A request and its reply are two topics. Which request a reply is for stands in the header of the packet
//! (`rmw_fastrtps`), or in front of the content (`rmw_cyclonedds`: 8 bytes of the client, 8 bytes of number, sent back
//! as they came). A process speaks one of the two forms.
//!
//! The middleware (RustDDS 0.15.1) writes one byte too many into the header of a packet that is cut into fragments, so a
//! reply in the first form must fit into one packet: [`PACKET_BYTES_NEAR`] to clients on this machine,
//! [`PACKET_BYTES_FAR`] as soon as one is elsewhere. A larger one is not sent, and the log says what to do.

use super::environment::ServiceMapping;
use super::graph::{Graph, GraphError, Reader, WriteError, Writer, participant_of};
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

/// Largest reply with its request in the header, bytes, while all clients are on this machine.
pub const PACKET_BYTES_NEAR: usize = 60_000;
/// The same when a client is on another machine: what fits into a packet of Ethernet.
pub const PACKET_BYTES_FAR: usize = 1_300;

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
    /// The reply does not fit into a packet.
    #[error(
        "{service}: a reply of {bytes} bytes cannot be sent with this middleware, {limit} is the limit; ask for fewer \
         parameters at a time, or set RMW_IMPLEMENTATION=rmw_cyclonedds_cpp for client and node"
    )]
    TooLarge {
        /// Name of the service.
        service: &'static str,
        /// Length of the reply.
        bytes: usize,
        /// What fits.
        limit: usize,
    },
}

/// An answer on its way.
#[derive(Debug)]
pub struct Reply {
    cdr: Vec<u8>,
    related: SampleIdentity,
}

impl Reply {
    /// The client's participant.
    #[must_use]
    pub fn client(&self) -> [u8; 12] {
        participant_of(&self.related.writer_guid)
    }
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

    /// Answers one request; nothing is sent yet.
    ///
    /// # Errors
    /// It cannot be answered; nothing has changed.
    pub fn serve(
        &self,
        request: &DeserializedCacheChange<Payload>,
        store: &mut ParameterStore,
        now: Time,
    ) -> Result<(Reply, Option<Change>), ServiceError> {
        let bytes = request.sample.as_bytes();
        let (header, content) = match self.mapping {
            ServiceMapping::Enhanced => (Vec::new(), bytes.to_vec()),
            ServiceMapping::Cyclone => split(bytes)
                .ok_or(ServiceError::NoHeader { service: self.service.name(), bytes: bytes.len() })?,
        };
        let (reply, change) = self.service.answer(&content, store, now)?;
        let mut cdr = reply[..ENCAPSULATION_BYTES].to_vec();
        cdr.extend(header);
        cdr.extend(&reply[ENCAPSULATION_BYTES..]);
        Ok((Reply { cdr, related: identity(request) }, change))
    }

    /// The writer of replies.
    #[must_use]
    pub fn replies(&self) -> &Writer {
        &self.replies
    }

    /// Sends an answer; `is_near` if all clients are on this machine.
    ///
    /// # Errors
    /// It cannot be sent.
    pub fn send(&self, reply: Reply, is_near: bool) -> Result<(), ServiceError> {
        let Reply { cdr, related } = reply;
        if self.mapping == ServiceMapping::Cyclone {
            return Ok(self.replies.send(cdr)?);
        }
        let limit = if is_near { PACKET_BYTES_NEAR } else { PACKET_BYTES_FAR };
        if cdr.len() > limit {
            return Err(ServiceError::TooLarge { service: self.service.name(), bytes: cdr.len(), limit });
        }
        Ok(self.replies.answer(cdr, related)?)
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
    use messages::rcl_interfaces::{GetParametersRequest, ListParametersRequest};

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

    /// Near clients can ask for everything at once.
    #[test]
    fn the_largest_replies_fit_into_a_packet_of_this_machine() {
        let settings = std::sync::Arc::new(crate::settings::Settings::default());
        let store = ParameterStore::new("/node", settings);
        let all = ListParametersRequest { prefixes: Vec::new(), depth: 0 };
        let names = store.list(&all).result.names;
        let list = encoded(&store.list(&all)).len();
        let values = encoded(&store.get(&GetParametersRequest { names: names.clone() })).len();
        assert!(list < PACKET_BYTES_NEAR, "{list} bytes for {} names", names.len());
        assert!(values < PACKET_BYTES_NEAR, "{values} bytes");
    }

    #[test]
    fn a_request_without_header_is_refused() {
        for length in 0..ENCAPSULATION_BYTES + CYCLONE_HEADER_BYTES {
            assert_eq!(split(&vec![0; length]), None, "{length} bytes");
        }
    }
}

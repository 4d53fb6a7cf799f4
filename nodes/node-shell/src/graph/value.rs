//! Values that nodes of one process hand to each other as themselves, and the message of each, made once and only when somebody
//! wants it.

use std::any::Any;
use std::sync::{Arc, OnceLock};

use msgs::convert::ConvertError;
use msgs::{Domain, RosMessage};

/// A value in transit, whatever its type.
pub(crate) trait InTransit: Send + Sync {
    /// The value itself.
    fn value(&self) -> Arc<dyn Any + Send + Sync>;

    /// Its message.
    fn message(&self) -> Arc<dyn Any + Send + Sync>;
}

/// A value with its message, once that was wanted.
pub(crate) struct Lazy<T: Domain> {
    value: Arc<T>,
    message: OnceLock<Arc<T::Message>>,
}

impl<T: Domain> Lazy<T> {
    pub(crate) fn new(value: Arc<T>) -> Self {
        Self { value, message: OnceLock::new() }
    }

    /// The message, made at the first call.
    pub(crate) fn its_message(&self) -> &Arc<T::Message> {
        self.message.get_or_init(|| Arc::new(self.value.to_message()))
    }
}

impl<T: Domain> InTransit for Lazy<T> {
    fn value(&self) -> Arc<dyn Any + Send + Sync> {
        let value: Arc<T> = Arc::clone(&self.value);
        value
    }

    fn message(&self) -> Arc<dyn Any + Send + Sync> {
        let message: Arc<T::Message> = Arc::clone(self.its_message());
        message
    }
}

/// The items of a subscription: a message, or a value.
pub trait Incoming: Send + Sync + Sized + 'static {
    /// Its message type on the network.
    type Message: RosMessage;

    /// Of a message.
    fn of_message(message: Arc<Self::Message>) -> Arc<Self>;

    /// Of a value that was published in this process; `value` gives it, `message` makes its message.
    #[doc(hidden)]
    fn of_value(
        value: impl FnOnce() -> Arc<dyn Any + Send + Sync>,
        message: impl FnOnce() -> Arc<dyn Any + Send + Sync>,
    ) -> Option<Arc<Self>>;
}

impl<M: RosMessage> Incoming for M {
    type Message = M;

    fn of_message(message: Arc<M>) -> Arc<M> {
        message
    }

    fn of_value(
        _value: impl FnOnce() -> Arc<dyn Any + Send + Sync>,
        message: impl FnOnce() -> Arc<dyn Any + Send + Sync>,
    ) -> Option<Arc<M>> {
        message().downcast().ok()
    }
}

/// A value as it came.
#[derive(Clone, Debug)]
pub enum Arrived<T: Domain> {
    /// As it was published in this process: the very value.
    Value(Arc<T>),
    /// As a message, from outside or from a publisher of messages.
    Message(Arc<T::Message>),
}

impl<T: Domain> Arrived<T> {
    /// The value; converted where it came as a message.
    ///
    /// # Errors
    /// When the message is no such value.
    pub fn value(&self) -> Result<Arc<T>, ConvertError> {
        match self {
            Self::Value(value) => Ok(Arc::clone(value)),
            Self::Message(message) => T::from_message(message).map(Arc::new),
        }
    }
}

impl<T: Domain> Incoming for Arrived<T> {
    type Message = T::Message;

    fn of_message(message: Arc<T::Message>) -> Arc<Self> {
        Arc::new(Self::Message(message))
    }

    fn of_value(
        value: impl FnOnce() -> Arc<dyn Any + Send + Sync>,
        message: impl FnOnce() -> Arc<dyn Any + Send + Sync>,
    ) -> Option<Arc<Self>> {
        // Another value type may have the same message.
        match value().downcast::<T>() {
            Ok(value) => Some(Arc::new(Self::Value(value))),
            Err(_) => message().downcast::<T::Message>().ok().map(Self::of_message),
        }
    }
}

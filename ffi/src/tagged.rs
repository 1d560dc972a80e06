//! Objects of fixed size that this library keeps in C's memory, between two tags that tell them from anything else.

use crate::code::Refusal;
use crate::memory::{Arguments, OutObject};

/// What C's struct holds.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct Tagged<T> {
    tag: u64,
    content: T,
    end_tag: u64,
}

/// What lies between the tags.
pub(crate) trait Content: Copy + 'static {
    /// C's struct.
    type Struct;
    /// The first tag; the last is its complement.
    const TAG: u64;
    /// The content fits C's struct.
    const FITS: () = assert!(
        size_of::<Tagged<Self>>() <= size_of::<Self::Struct>()
            && align_of::<Tagged<Self>>() <= align_of::<Self::Struct>()
    );
    /// Counts the memory that it refers to among what the call reads.
    fn also_read(&self, arguments: &mut Arguments, argument: u32);
}

/// The content of the struct that an argument points to, once all other arguments are known; the struct and the memory that it refers to are counted
/// among what the call reads. Whatever argument was refused so far is handed out here.
///
/// # Safety
/// `pointer` is null or points to a struct, written by [`put`] or all of its bytes set to anything but what such a struct holds.
pub(crate) unsafe fn tagged<'a, T: Content>(
    arguments: &mut Arguments,
    argument: u32,
    pointer: *const T::Struct,
) -> Result<&'a T, Refusal> {
    let pointer = arguments.object(argument, pointer).pointer();
    // SAFETY: the caller's promise.
    unsafe { known(arguments, argument, pointer) }
}

/// As [`tagged`], of an argument that is written, too.
///
/// # Safety
/// As [`tagged`]; nobody else uses the struct meanwhile.
pub(crate) unsafe fn taken<T: Content>(
    arguments: &mut Arguments,
    argument: u32,
    pointer: *mut T::Struct,
) -> Result<(T, OutObject<T::Struct>), Refusal> {
    let out = arguments.out_object(argument, pointer);
    // SAFETY: the caller's promise; the copy ends the reference.
    let content = *unsafe { known::<T>(arguments, argument, pointer)? };
    Ok((content, out))
}

unsafe fn known<'a, T: Content>(
    arguments: &mut Arguments,
    argument: u32,
    pointer: *const T::Struct,
) -> Result<&'a T, Refusal> {
    let () = T::FITS;
    let pointer = pointer.cast::<Tagged<T>>();
    arguments.compared()?;
    // SAFETY: not null, aligned; both tags are plain numbers and lie within the struct.
    let tags = unsafe { ((&raw const (*pointer).tag).read(), (&raw const (*pointer).end_tag).read()) };
    if tags != (T::TAG, !T::TAG) {
        return Err(Refusal::NotOpened { argument });
    }
    // SAFETY: the tags say that this library has written the struct.
    let content = unsafe { &(*pointer).content };
    content.also_read(arguments, argument);
    arguments.compared()?;
    Ok(content)
}

/// Writes C's struct.
///
/// # Safety
/// It can be written.
pub(crate) unsafe fn put<T: Content>(out: &OutObject<T::Struct>, content: T) {
    let () = T::FITS;
    // SAFETY: the content is no larger and no more aligned than the struct, which can be written.
    unsafe { out.pointer().cast::<Tagged<T>>().write(Tagged { tag: T::TAG, content, end_tag: !T::TAG }) };
}

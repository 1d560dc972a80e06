//! The one place where C's pointers become references: checked against null, misalignment, impossible lengths and overlap first.

use core::marker::PhantomData;

use crate::code::{Refusal, hab_code, hab_error_detail};

/// Most memory that a call has to do with: a fit with all its arguments, the bytes of the model, and the workspace of the prepared form.
const MOST: usize = 16;

/// Bytes that an argument points to.
#[derive(Clone, Copy)]
struct Span {
    argument: u32,
    from: usize,
    bytes: usize,
    written: bool,
}

/// The memory of a call's arguments so far. An argument is refused when it overlaps an earlier one and one of the two is written.
///
/// A refusal is kept until [`Arguments::compared`] hands it out, so that the detail, which a refusal is written to, has been compared with every argument.
pub(crate) struct Arguments {
    spans: [Span; MOST],
    count: usize,
    refusal: Option<Refusal>,
    detail: u32,
    detail_overlaps: bool,
}

/// One readable object.
pub(crate) struct Object<T>(*const T);
/// One writable object.
pub(crate) struct OutObject<T>(*mut T);
/// Readable elements.
pub(crate) struct Input<T>(*const T, usize, PhantomData<T>);
/// Writable elements.
pub(crate) struct Output<T>(*mut T, usize, PhantomData<T>);

impl Arguments {
    pub(crate) const fn new() -> Self {
        Arguments {
            spans: [Span { argument: 0, from: 0, bytes: 0, written: false }; MOST],
            count: 0,
            refusal: None,
            detail: 0,
            detail_overlaps: false,
        }
    }

    /// `Ok` when no argument so far was refused; nothing may be read or written before.
    pub(crate) fn compared(&self) -> Result<(), Refusal> {
        self.refusal.map_or(Ok(()), Err)
    }

    /// An object that is read; `argument` is its position from 1.
    pub(crate) fn object<T>(&mut self, argument: u32, pointer: *const T) -> Object<T> {
        self.register(argument, pointer, 1, false);
        Object(pointer)
    }

    /// An object that is written, or read and written.
    pub(crate) fn out_object<T>(&mut self, argument: u32, pointer: *mut T) -> OutObject<T> {
        self.register(argument, pointer, 1, true);
        OutObject(pointer)
    }

    /// Elements that are read. Null is an empty slice when it has no elements.
    pub(crate) fn input<T>(&mut self, argument: u32, pointer: *const T, len: usize) -> Input<T> {
        self.register(argument, pointer, len, false);
        Input(pointer, len, PhantomData)
    }

    /// Elements that are written, or read and written.
    pub(crate) fn output<T>(&mut self, argument: u32, pointer: *mut T, len: usize) -> Output<T> {
        self.register(argument, pointer, len, true);
        Output(pointer, len, PhantomData)
    }

    /// As many whole floats as lie in the bytes of a workspace.
    pub(crate) fn workspace(&mut self, argument: u32, pointer: *mut u8, bytes: usize) -> Output<f32> {
        self.output(argument, pointer.cast(), bytes / size_of::<f32>())
    }

    /// Memory that belongs to an argument without being pointed to by it: the bytes of a model, the workspace of a prepared form.
    pub(crate) fn also_read<T>(&mut self, argument: u32, elements: &[T]) {
        self.register(argument, elements.as_ptr(), elements.len(), false);
    }

    fn register<T>(&mut self, argument: u32, pointer: *const T, len: usize, written: bool) {
        if let Err(refusal) = self.required(argument, pointer, len, written) {
            self.refusal.get_or_insert(refusal);
        }
    }

    fn required<T>(&mut self, argument: u32, pointer: *const T, len: usize, written: bool) -> Result<(), Refusal> {
        if len == 0 {
            return Ok(());
        }
        if pointer.is_null() {
            return Err(Refusal::NullPointer { argument });
        }
        let (from, largest) = (pointer.addr(), isize::MAX.unsigned_abs());
        let bytes = len.checked_mul(size_of::<T>()).filter(|&bytes| bytes <= largest);
        let bytes = bytes.filter(|&bytes| from.checked_add(bytes).is_some()).ok_or(Refusal::BadLength { argument })?;
        let span = Span { argument, from, bytes, written };
        let known = self.spans.get(..self.count).unwrap_or_default();
        let mut others = known.iter().filter(|other| (other.written || written) && other.overlaps(&span));
        let first = others.next().map(|other| other.argument);
        let with_detail =
            [first, Some(argument)].contains(&Some(self.detail)) || others.any(|other| other.argument == self.detail);
        self.detail_overlaps |= first.is_some() && with_detail;
        *self.spans.get_mut(self.count).ok_or(Refusal::Internal)? = span;
        self.count += 1;
        if !pointer.is_aligned() {
            return Err(Refusal::Misaligned { argument, alignment: align_of::<T>() as u32 });
        }
        match first {
            Some(other) => Err(Refusal::Overlap { arguments: [other.min(argument), other.max(argument)] }),
            None => Ok(()),
        }
    }
}

impl Span {
    fn overlaps(&self, other: &Span) -> bool {
        self.from < other.from + other.bytes && other.from < self.from + self.bytes
    }
}

impl<T> Object<T> {
    /// The object.
    ///
    /// # Safety
    /// The pointer is valid for reads of a `T` that nobody writes while the reference lives.
    pub(crate) unsafe fn get<'a>(&self) -> &'a T {
        // SAFETY: the caller's promise; it was found to be neither null nor misaligned.
        unsafe { &*self.0 }
    }

    pub(crate) fn pointer(&self) -> *const T {
        self.0
    }
}

impl<T> OutObject<T> {
    /// Writes the object, whatever was there.
    ///
    /// # Safety
    /// The pointer is valid for writes of a `T`.
    pub(crate) unsafe fn set(&self, value: T) {
        // SAFETY: the caller's promise; it was found to be neither null nor misaligned.
        unsafe { self.0.write(value) }
    }

    pub(crate) fn pointer(&self) -> *mut T {
        self.0
    }
}

impl<T: Copy> OutObject<T> {
    /// What the object holds before it is written.
    ///
    /// # Safety
    /// The pointer is valid for reads of a `T`.
    pub(crate) unsafe fn old(&self) -> T {
        // SAFETY: the caller's promise; it was found to be neither null nor misaligned.
        unsafe { self.0.read() }
    }
}

impl<T> Input<T> {
    /// The elements.
    ///
    /// # Safety
    /// The pointer is valid for reads of so many elements that nobody writes while the slice lives.
    pub(crate) unsafe fn slice<'a>(&self) -> &'a [T] {
        if self.1 == 0 {
            return &[];
        }
        // SAFETY: the caller's promise; pointer and length were checked, and no argument that is written overlaps.
        unsafe { core::slice::from_raw_parts(self.0, self.1) }
    }
}

impl<T> Output<T> {
    /// The elements.
    ///
    /// # Safety
    /// The pointer is valid for reads and writes of so many elements that nobody else touches while the slice lives. What C has not set yet is
    /// memory with some bits as far as Rust can know, any bits are a value of the elements used here (`f32`, `u32`, bytes), and nothing is read before
    /// it is written but what the header calls a start.
    pub(crate) unsafe fn slice<'a>(&self) -> &'a mut [T] {
        if self.1 == 0 {
            return &mut [];
        }
        // SAFETY: the caller's promise; pointer and length were checked, and no other argument overlaps.
        unsafe { core::slice::from_raw_parts_mut(self.0, self.1) }
    }
}

/// Runs a function's body with the memory of its arguments, the optional detail among them, and turns what comes of it into a code.
///
/// # Safety
/// `detail` is null or points to a detail that can be written.
#[inline(always)]
pub(crate) unsafe fn call(
    detail: *mut hab_error_detail,
    position: u32,
    body: impl FnOnce(&mut Arguments) -> Result<(), Refusal>,
) -> hab_code {
    let mut arguments = Arguments::new();
    // Before the others, so that each of them is compared with it.
    if !detail.is_null() {
        arguments.detail = position;
        arguments.out_object(position, detail);
        if let Err(refusal) = arguments.compared() {
            return refusal.detail().0;
        }
    }
    let Err(refusal) = body(&mut arguments) else { return hab_code::HAB_OK };
    let (code, [first, second]) = refusal.detail();
    // Where the detail itself overlaps another argument, that argument stays as it was.
    if !detail.is_null() && !arguments.detail_overlaps {
        let argument = refusal.argument();
        // SAFETY: not null, aligned, and the caller promises that it can be written.
        unsafe { detail.write(hab_error_detail { code: code as i32, first, second, argument }) }
    }
    code
}

"""The logical units of running programs: units of the disk, the terminal as a unit for reading and writing, and devices
(TCP, serial lines) that tasks attach by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from msgspec import Struct, field

from vrs_cli import errors
from vrs_cli.devices.outside import TCP, YET, Outside, Waits
from vrs_cli.files.opening import Folder
from vrs_cli.language.run import effects

if TYPE_CHECKING:
    from vrs_cli.devices.device import Device
    from vrs_cli.files.disk import Disk, Unit

END_OF_LINE = "\r"  # GETC returns this character (the Return key) at the end of a line of the terminal


class Devices(Struct, eq=False):
    """The logical units of all tasks. `folder`: the folder for the files of tasks without their own folder. `show`:
    writes to the terminal; its arguments are a string, and whether the line ends after it. `outside`: provides all
    other devices; `missed`: called once for each device that cannot be opened. `spend`, `hold`: as for `Disk`."""

    folder: Folder
    show: Callable[[str, bool], None]
    outside: Outside
    missed: Callable[[errors.DeviceNotReady], None]
    spend: Callable[[int], None]
    hold: Callable[[int], None]
    folders: dict[int, Folder] = field(default_factory=dict)  # the folder of each task that has its own folder
    _disk: Disk | None = None  # None until a task uses it
    _devices: dict[tuple[int, int], Device] = field(default_factory=dict)  # attached devices by task and unit
    _missing: set[str] = field(default_factory=set)
    _typed: list[int] = field(default_factory=list)  # codes that GETC reads next from the terminal
    _taken: list[int] = field(default_factory=list)  # codes that the current step has read from `_typed`
    # codes read by the current step from devices, by task and unit
    _taken_of: dict[tuple[int, int], list[int]] = field(default_factory=dict)

    @property
    def disk(self) -> Disk:
        """Return the units of the disk."""
        if self._disk is None:
            from vrs_cli.files.disk import Disk  # imported here because most programs use no files

            self._disk = Disk(self.folder_of, self.spend, self.hold)
        return self._disk

    # --- folders ---

    def folder_of(self, task: int) -> Folder:
        """Return the folder for the files of a task."""
        return self.folders.get(task, self.folder)

    def place(self, task: int, folder: Folder | None) -> None:
        """Set the folder for the files of a new task; if it is None, the task uses the common `folder`."""
        self.folders.pop(task, None)
        if folder is not None:
            self.folders[task] = folder

    # --- operations ---

    def perform(self, task: int, effect: effects.UnitEffect) -> str | Waits | None:
        """Carry out an operation of a task on a unit. Return the answer, or `Waits` if the task must wait. Raises
        UnitNotAttached, FileOutside."""
        if isinstance(effect, effects.AttachUnit):
            return self._attach(task, effect)
        device = self._devices.get((task, effect.unit))
        return self._of_disk(task, effect) if device is None else self._of_device(device, task, effect)

    def _attach(self, task: int, effect: effects.AttachUnit) -> str:
        unit, name = effect.unit, effect.device
        if unit == effects.TERMINAL:
            self.disk.terminal.status = effects.SUCCESS
        elif name is None:
            unit = self.disk.free(task) if unit == effects.ANY else unit
            if (task, unit) not in self._devices:
                self.disk.attach(task, unit)
        else:
            if unit == effects.ANY:
                free = [one for one in effects.OTHERS if (task, one) not in self._devices]
                if not free:
                    raise errors.UnitNotAttached("units 9 to 16 are all in use", "DETACH one")
                unit = free[0]
            self._attach_device(task, unit, name)
        return str(unit)

    def _attach_device(self, task: int, unit: int, name: str) -> None:
        """Attach a device to a unit of a task. If the device cannot be opened, each use of the unit sets its status to
        that error."""
        there = self._devices.get((task, unit))
        if there is not None and there.attached == name and there.fault is None:
            there.status = effects.SUCCESS
            return
        if there is not None:
            there.close()
        from vrs_cli.devices.device import Device  # imported here because few programs attach devices

        device = self._devices[task, unit] = Device(name, name, self.outside)
        with self._attempt(device):
            try:
                if name != TCP and any(one.attached == name and one.open for one in self._devices.values()):
                    raise errors.UnitAttached(name, "another task has it")
                device.begin()
            except (errors.DeviceNotReady, errors.UnitAttached) as fault:
                device.fault = fault
                if isinstance(fault, errors.DeviceNotReady) and name not in self._missing:
                    self._missing.add(name)
                    self.missed(fault)
                raise

    def _of_disk(self, task: int, effect: effects.UnitEffect) -> str | None:
        """Carry out an operation on a unit of the disk, or on the terminal."""
        disk = self.disk
        match effect:
            case effects.DetachUnit(unit=unit) if unit != effects.TERMINAL:
                disk.detach(task, unit)
            case effects.OpenFile():
                disk.open(task, effect.unit, effect.name, effect.access)
            case effects.OpenDevice() | effects.CommandDevice():
                disk.attached_unit(task, effect.unit).status = errors.FileError.code
            case effects.CloseFile():
                disk.close(task, effect.unit)
            case effects.DeleteFile():
                disk.delete(task, effect.unit, effect.name)
            case effects.ReadRecord():
                return disk.read(task, effect.unit)
            case effects.WriteRecord(unit=unit) if unit == effects.TERMINAL:
                self.show(effect.text, effect.newline)
                self.disk.terminal.status, self.disk.terminal.length = effects.SUCCESS, len(effect.text)
            case effects.WriteRecord():
                disk.write(task, effect.unit, effect.text + ("\n" if effect.newline else ""))
            case effects.RecordRefused(unit=unit) if unit == effects.TERMINAL:
                self.disk.terminal.status = effect.code
            case effects.RecordRefused():
                disk.attached_unit(task, effect.unit).status = effect.code
        return None

    def _of_device(self, device: Device, task: int, effect: effects.UnitEffect) -> str | Waits | None:
        with self._attempt(device):
            match effect:
                case effects.OpenDevice():
                    if not device.dialing:
                        device.open_at(effect.how, [one.name for one in self._devices.values() if one.open])
                    return device.dial_result()
                case effects.CommandDevice():
                    device.command(effect.command, effect.data)
                case effects.ReadRecord():
                    return device.read(effect.notices, effect.wait)
                case effects.WriteRecord():
                    return device.write(effect.text, effect.newline, effect.handle, effect.wait)
                case effects.RecordRefused():
                    device.status = effect.code
                case effects.AwaitLine():
                    return None if device.has_more else YET
                case effects.CloseFile():
                    device.close_port()
                case effects.DetachUnit():
                    device.close()
                    del self._devices[task, effect.unit]
                case _:
                    raise errors.FileError(device.name, "it is not the disk")
        return None

    @staticmethod
    @contextmanager
    def _attempt(device: Device) -> Iterator[None]:
        """Run the body of a `with` statement; if a device fails in it, set the status of the device to the error.
        Errors made by the program are raised."""
        try:
            yield
        except errors.FileError as error:
            device.status, device.length = error.code, 0

    def expire(self, task: int, effect: effects.UnitEffect) -> None:
        """End the wait of a task for a unit because its time limit has passed."""
        self._devices[task, effect.unit].expire(of_getc=isinstance(effect, effects.AwaitLine))

    def unit(self, task: int, unit: int) -> Device | Unit:
        """Return the device, disk unit or terminal that a unit number of a task refers to. It has the status of its
        last operation and the length of its last record."""
        of_program = self.disk.terminal if unit == effects.TERMINAL else self.disk.unit(task, unit)
        return self._devices.get((task, unit), of_program)

    def connection(self, task: int, unit: int) -> int | None:
        """Return the handle of the connection from which the last READ came; None if the unit has no connections."""
        device = self._devices.get((task, unit))
        return None if device is None else device.handle

    # --- arrivals from outside ---

    def arrive(self, now: float) -> None:
        """Pass data that has arrived from outside by the time `now` [s] to its devices."""
        for arrival in self.outside.take(now):
            for device in self._devices.values():
                if device.open and device.name == arrival.device:
                    device.arrive(arrival)

    # --- characters ---

    def begin_reading(self) -> None:
        self._taken, self._taken_of = [], {}

    def put_back(self) -> None:
        self._typed, self._taken = [*self._taken, *self._typed], []
        for place, taken in self._taken_of.items():
            self._devices[place].put_back(taken)
        self._taken_of = {}

    def character(self, task: int, unit: int, wait: bool) -> int:
        """Return the code of the next character, or of an error. The terminal delivers whole lines: raises LineMissing
        if its next line must be typed first."""
        if (device := self._devices.get((task, unit))) is not None:
            try:
                byte = device.character(wait)
            except errors.FileError as error:
                device.status = error.code
                return error.code
            if isinstance(byte, Waits):
                raise errors.LineMissing(
                    f"GETC waits for {device.name}", "a program or an assignment can wait", value=unit
                )
            self._taken_of.setdefault((task, unit), []).append(byte)
            return byte
        if unit != effects.TERMINAL:
            return self.disk.character(task, unit)
        if self._typed:
            self._taken.append(self._typed.pop(0))
            return self._taken[-1]
        if not wait:
            return errors.NoDataReceived.code
        raise errors.LineMissing(
            "GETC waits for the terminal", "a program or an assignment can wait", value=effects.TERMINAL
        )

    def line(self, line: str | None, *, of_getc: bool = False) -> str | None:
        """Receive a line typed at the terminal (None: end of the input) and return it. `of_getc`: the line is for GETC,
        which reads its characters one by one; otherwise unread characters of earlier lines are dropped."""
        come = [errors.EndOfInput.code] if line is None else [ord(one) for one in line + END_OF_LINE]
        self._typed = [*self._typed, *come] if of_getc else []
        terminal = self.disk.terminal
        terminal.status, terminal.length = (errors.EndOfInput.code, 0) if line is None else (effects.SUCCESS, len(line))
        return line

    # --- endings ---

    def rest(self, task: int) -> None:
        """Save what a stopped task has written to the disk. Its connections stay open, because the task may
        continue."""
        if self._disk is not None:
            self._disk.rest(task)

    def release(self, task: int) -> None:
        """Close and detach all units of a task that has ended."""
        if self._disk is not None:
            self._disk.release(task)
        for place in [place for place in self._devices if place[0] == task]:
            self._devices.pop(place).close()

    def close_all(self) -> None:
        """Close all units of all tasks, when no task runs any more."""
        if self._disk is not None:
            self._disk.close_all()
        self._devices.clear()
        self.outside.close_all()

"""The public names: those at the top of the package, and those of its namespaces."""

import inspect

import kerrcaustics as kc

SPACES = (kc, kc.skies, kc.disks, kc.pictures)
PUBLIC = {
    name: getattr(space, name)
    for space in SPACES
    for name in space.__all__
    if not inspect.ismodule(getattr(space, name))
}

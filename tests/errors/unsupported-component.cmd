hal compile unsupported-component.comp

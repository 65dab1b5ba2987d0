hal compile bad-component-source.comp

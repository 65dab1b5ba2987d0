hal compile bad-component-source-whole.comp
